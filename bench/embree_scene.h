// Builds the geometry of a scene in Embree directly, with a selectable representation of motion.
#pragma once

#include "core/scene/scene.h"

#include <memory>
#include <span>

namespace strobe::bench {

/// The representation of rigid motion in Embree.
enum class MotionStyle {
    AsRendered, ///< the representation of strobe::Tracer
    Matrix,     ///< instances with matrix keys that are interpolated linearly
    Quaternion, ///< instances with scale, skew, rotation and translation keys
    Baked,      ///< vertices in world space, one time step per key
};

/// A representation of motion and its number of keys.
struct MotionChoice {
    MotionStyle style = MotionStyle::AsRendered;
    /// Evenly spaced over the shutter; 1: static at the middle of the shutter. Unused by AsRendered.
    int keys = 0;
};

/// Embree without any code of strobe except the packet's mask and the intersection of quadrics: the baseline
/// for the renderer. Built with the settings of strobe::Tracer. The scene must outlive it, since it refers to
/// its meshes. The constructor throws Error for alpha masks, and for quadrics and deforming meshes with
/// MotionStyle::Baked.
class EmbreeScene {
  public:
    EmbreeScene(const Scene& scene, const MotionChoice& choice);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// Traces lanes 0 … n-1 with rtcIntersect16, with or without Embree's coherent flag.
    void intersect(RayPacket& packet, int n, bool coherent) const;
    /// Traces lanes 0 … n-1 one by one with rtcIntersect1.
    void intersectSingly(RayPacket& packet, int n) const;
    /// Traces all lanes of all packets as a stream of Embree 3. Does nothing and returns false with Embree 4,
    /// which has no streams.
    bool intersectStream(std::span<RayPacket> packets) const;
    /// Traces lanes 0 … n-1 with rtcOccluded16: sets tfar < 0 for occluded rays.
    void occluded(RayPacket& packet, int n) const;
    /// Returns whether any instance moves. strobe::Tracer does not use the coherent flag then.
    bool movingInstances() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace strobe::bench
