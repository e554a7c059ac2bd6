// A scene's geometry given to Embree directly, with its motion expressed in a way of one's choice.
#pragma once

#include "core/scene/scene.h"

#include <memory>
#include <span>

namespace strobe::bench {

/// How geometry that moves rigidly is told to Embree.
enum class MotionStyle {
    AsRendered, ///< as strobe::Tracer does
    Matrix,     ///< instances with matrix keys, interpolated linearly
    Quaternion, ///< instances with scale, skew, rotation and translation keys
    Baked,      ///< vertices in world space, one time step per key
};

struct MotionChoice {
    MotionStyle style = MotionStyle::AsRendered;
    int keys = 0; ///< uniform over the shutter; 1: at rest where it is at mid-shutter. Not for AsRendered
};

/// Nothing between the caller and Embree but the packet's mask: the floor that the renderer is measured
/// against. Built with the same settings as strobe::Tracer. Refers to the scene's meshes. Cut-outs (alpha)
/// are not followed: scenes with them are refused with an Error, as is a Baked quadric or deforming mesh.
class EmbreeScene {
  public:
    EmbreeScene(const Scene& scene, const MotionChoice& choice);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// Lanes 0 … n-1, as rtcIntersect16, with or without Embree's coherent flag.
    void intersect(RayPacket& packet, int n, bool coherent) const;
    /// Lanes 0 … n-1 one by one, as rtcIntersect1.
    void intersectSingly(RayPacket& packet, int n) const;
    /// All packets, whole, as one of Embree 3's streams; false, and nothing done, with Embree 4, which has
    /// none.
    bool intersectStream(std::span<RayPacket> packets) const;
    /// As rtcOccluded16: tfar < 0 where anything lies before it.
    void occluded(RayPacket& packet, int n) const;
    /// True when some instance moves; strobe::Tracer then leaves the coherent flag out.
    bool movingInstances() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace strobe::bench
