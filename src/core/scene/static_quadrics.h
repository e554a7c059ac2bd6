// Tracing of the first few static quadrics outside of instances, without Embree: there they would cost a
// second BVH beside the one of the triangles, and a callback per primitive.
#pragma once

#include "core/math/api.h"
#include "core/scene/tracer.h"

namespace STROBE_API strobe {

/// Returns the bounds of a placed quadric in the space of its group.
Box3f quadricBounds(const PlacedShape& placed);

/// The active rays of a packet, in Embree's format.
struct alignas(64) PacketMask {
    int active[RayPacket::kSize]; ///< -1: active, 0: not

    /// Rays 0 … n-1 are active.
    explicit PacketMask(int n) {
        for (int i = 0; i < RayPacket::kSize; ++i)
            active[i] = i < n ? -1 : 0;
    }
    /// Deactivates rays that miss the box or whose id is `excludedId`. Returns whether any ray is still
    /// active.
    bool keepIntersecting(const RayPacket& packet, const Box3f& box, uint32_t excludedId = kNone);
};

/// A list of quadrics, each with a bounding box that is tested for a whole packet at once.
class StaticQuadrics {
  public:
    /// Every packet is tested against every box: with more quadrics, Embree's BVH is faster.
    static constexpr size_t kMax = 4;

    bool isFull() const { return m_entries.size() >= kMax; }
    /// Adds the quadric of `geometry`. `index` is the geometry's index in group 0; `intersect` writes it to
    /// hits as the geometry ID. Precondition: !isFull().
    void add(const Geometry& geometry, uint32_t index);
    /// Like Tracer::intersect, for the rays in `mask`. Replaces farther hits of the packet.
    void intersect(RayPacket& packet, const PacketMask& mask) const;
    /// Like Tracer::occluded, for the rays in `mask`.
    void occluded(RayPacket& packet, const PacketMask& mask) const;
    /// Extends `box` by the bounds of all quadrics.
    void extend(Box3f& box) const;

  private:
    struct Entry {
        const Quadric* quadric;
        M44f toObject;
        Box3f box; ///< with a margin
        uint32_t geometry;
        uint32_t excludedId; ///< rays with this RayPacket::id are not tested; kNone: all are
    };
    template <class OnHit>
    void trace(const RayPacket& packet, const PacketMask& mask, const OnHit& onHit) const;

    std::vector<Entry> m_entries;
};

} // namespace strobe
