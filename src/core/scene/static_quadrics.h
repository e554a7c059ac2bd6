// The few quadrics that stand still in the world, traced without Embree: to it they are a second hierarchy
// beside that of the triangles, and a callback for each.
#pragma once

#include "core/scene/tracer.h"

namespace strobe {

/// Bounds of a placed quadric in its group's space.
Box3f quadricBounds(const PlacedShape& placed);

/// Which lanes of a packet are to be traced: -1 or 0, as Embree wants it.
struct alignas(64) PacketMask {
    int lanes[RayPacket::kSize];
    explicit PacketMask(int n) {
        for (int i = 0; i < RayPacket::kSize; ++i)
            lanes[i] = i < n ? -1 : 0;
    }
    /// Leaves the lanes whose rays pass through the box and whose id is not `except`; false when there is
    /// none.
    bool keepThrough(const RayPacket& packet, const Box3f& box, uint32_t except = kNone);
};

class StaticQuadrics {
  public:
    /// Each costs every packet a test of its box; more than these are better off in Embree.
    static constexpr size_t kMax = 4;

    bool isFull() const { return m_entries.size() >= kMax; }
    /// `index`: of the geometry in the world.
    void add(const Geometry& geometry, uint32_t index);
    /// As those of Tracer, of the lanes that are valid.
    void intersect(RayPacket& packet, const PacketMask& valid) const;
    void occluded(RayPacket& packet, const PacketMask& valid) const;
    /// Extends `box` by all of them.
    void extend(Box3f& box) const;

  private:
    struct Entry {
        const Quadric* quadric;
        M44f toObject;
        Box3f box; ///< with a margin
        uint32_t geometry;
        uint32_t except; ///< rays with this id cannot hit it
    };
    template <class Met>
    void trace(const RayPacket& packet, const PacketMask& valid, const Met& met) const;

    std::vector<Entry> m_entries;
};

} // namespace strobe
