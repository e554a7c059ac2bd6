#include "core/scene/static_quadrics.h"

namespace strobe {

namespace {

/// Sets active[i] to 0 for rays that miss the box or whose id is `excludedId`: the slab test.
STROBE_TARGET_CLONES void deactivateMisses(const RayPacket& packet, const Box3f& box, uint32_t excludedId,
                                           int* active) {
    const V3f lower = box.min, upper = box.max;
    STROBE_IVDEP
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const float rx = 1 / packet.dx[i], ry = 1 / packet.dy[i], rz = 1 / packet.dz[i];
        const float x0 = (lower.x - packet.ox[i]) * rx, x1 = (upper.x - packet.ox[i]) * rx;
        const float y0 = (lower.y - packet.oy[i]) * ry, y1 = (upper.y - packet.oy[i]) * ry;
        const float z0 = (lower.z - packet.oz[i]) * rz, z1 = (upper.z - packet.oz[i]) * rz;
        const float near = std::max(std::max(std::min(x0, x1), std::min(y0, y1)),
                                    std::max(std::min(z0, z1), packet.tnear[i]));
        const float far = std::min(std::min(std::max(x0, x1), std::max(y0, y1)),
                                   std::min(std::max(z0, z1), packet.tfar[i]));
        // Conservative: a margin for rounding, and rays in a face of the box (0 * infinity is NaN) stay
        // active.
        const int intersects = near * 0.99999f > far * 1.00001f ? 0 : -1;
        active[i] &= packet.id[i] == excludedId ? 0 : intersects;
    }
}

/// Returns whether any ray of the packet has another id. Branch-free.
bool hasOtherId(const RayPacket& packet, uint32_t id) {
    uint32_t difference = 0;
    for (int i = 0; i < RayPacket::kSize; ++i)
        difference |= packet.id[i] ^ id;
    return difference != 0;
}

bool anyActive(const int* active) {
    int all = 0;
    for (int i = 0; i < RayPacket::kSize; ++i)
        all |= active[i];
    return all != 0;
}

} // namespace

Box3f quadricBounds(const PlacedShape& placed) {
    const Box3f box = placed.shape.quadric->bounds();
    Box3f out;
    for (int i = 0; i < 8; ++i)
        out.extendBy(
            transformPoint(placed.toParent, {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                                             i & 4 ? box.max.z : box.min.z}));
    // A disk parallel to an axis plane needs a box of positive thickness.
    const V3f margin(1e-6f * (length(out.max - out.min) + 1e-30f));
    return {out.min - margin, out.max + margin};
}

bool PacketMask::keepIntersecting(const RayPacket& packet, const Box3f& box, uint32_t excludedId) {
    deactivateMisses(packet, box, excludedId, active);
    return anyActive(active);
}

void StaticQuadrics::add(const Geometry& geometry, uint32_t index) {
    const PlacedShape& placed = geometry.placed;
    const uint32_t excludedId = geometry.light >= 0 ? RayPacket::idOfLight(geometry.light) : kNone;
    m_entries.push_back(
        {placed.shape.quadric.get(), placed.toParent.inverse(), quadricBounds(placed), index, excludedId});
}

/// Calls onHit(entry, i, t, u, v) for each ray i in `mask` that hits a quadric before packet.tfar[i].
template <class OnHit>
void StaticQuadrics::trace(const RayPacket& packet, const PacketMask& mask, const OnHit& onHit) const {
    for (const Entry& entry : m_entries) {
        if (!hasOtherId(packet, entry.excludedId))
            continue;
        PacketMask candidates = mask;
        if (candidates.keepIntersecting(packet, entry.box, entry.excludedId))
            intersectPacket(*entry.quadric, entry.toObject, candidates.active, packet.ox, RayPacket::kSize,
                            [&](unsigned i, float t, float u, float v) { onHit(entry, i, t, u, v); });
    }
}

void StaticQuadrics::intersect(RayPacket& packet, const PacketMask& mask) const {
    trace(packet, mask, [&](const Entry& entry, unsigned i, float t, float u, float v) {
        packet.tfar[i] = t;
        packet.u[i] = u;
        packet.v[i] = v;
        packet.prim[i] = 0;
        packet.geom[i] = entry.geometry;
        packet.inst[i] = kNone;
    });
}

void StaticQuadrics::occluded(RayPacket& packet, const PacketMask& mask) const {
    trace(packet, mask, [&](const Entry&, unsigned i, float, float, float) { packet.tfar[i] = -kInfinity; });
}

void StaticQuadrics::extend(Box3f& box) const {
    for (const Entry& entry : m_entries)
        box.extendBy(entry.box);
}

} // namespace strobe
