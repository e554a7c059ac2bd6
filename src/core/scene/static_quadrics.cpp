#include "core/scene/static_quadrics.h"

namespace strobe {

namespace {

/// Clears lanes whose rays do not pass through the box, and those whose id is `except`.
STROBE_TARGET_CLONES void clearMisses(const RayPacket& b, const Box3f& box, uint32_t except, int* lanes) {
    const V3f lower = box.min, upper = box.max;
    STROBE_IVDEP
    for (int i = 0; i < RayPacket::kSize; ++i) {
        const float rx = 1 / b.dx[i], ry = 1 / b.dy[i], rz = 1 / b.dz[i];
        const float x0 = (lower.x - b.ox[i]) * rx, x1 = (upper.x - b.ox[i]) * rx;
        const float y0 = (lower.y - b.oy[i]) * ry, y1 = (upper.y - b.oy[i]) * ry;
        const float z0 = (lower.z - b.oz[i]) * rz, z1 = (upper.z - b.oz[i]) * rz;
        const float near =
            std::max(std::max(std::min(x0, x1), std::min(y0, y1)), std::max(std::min(z0, z1), b.tnear[i]));
        const float far =
            std::min(std::min(std::max(x0, x1), std::max(y0, y1)), std::min(std::max(z0, z1), b.tfar[i]));
        // Rounding must not lose a ray; 0 * infinity (a ray in a face of the box) compares false and is kept.
        const int through = near * 0.99999f > far * 1.00001f ? 0 : -1;
        lanes[i] &= b.id[i] == except ? 0 : through;
    }
}

/// False when no lane has another id.
bool hasOther(const RayPacket& b, uint32_t id) {
    uint32_t other = 0;
    for (int i = 0; i < RayPacket::kSize; ++i)
        other |= b.id[i] ^ id;
    return other != 0;
}

bool any(const int* lanes) {
    int all = 0;
    for (int i = 0; i < RayPacket::kSize; ++i)
        all |= lanes[i];
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
    // A flat disk must not have an empty box.
    const V3f pad(1e-6f * (length(out.max - out.min) + 1e-30f));
    return {out.min - pad, out.max + pad};
}

bool PacketMask::keepThrough(const RayPacket& packet, const Box3f& box, uint32_t except) {
    clearMisses(packet, box, except, lanes);
    return any(lanes);
}

void StaticQuadrics::add(const Geometry& geometry, uint32_t index) {
    const PlacedShape& placed = geometry.placed;
    const uint32_t except = geometry.light >= 0 ? RayPacket::idOfLight(geometry.light) : kNone;
    m_entries.push_back(
        {placed.shape.quadric.get(), placed.toParent.inverse(), quadricBounds(placed), index, except});
}

/// Calls met(entry, i, t, u, v) where a ray hits.
template <class Met>
void StaticQuadrics::trace(const RayPacket& packet, const PacketMask& valid, const Met& met) const {
    for (const Entry& entry : m_entries) {
        if (!hasOther(packet, entry.except))
            continue;
        PacketMask through = valid;
        if (through.keepThrough(packet, entry.box, entry.except))
            intersectPacket(*entry.quadric, entry.toObject, through.lanes, packet.ox, RayPacket::kSize,
                            [&](unsigned i, float t, float u, float v) { met(entry, i, t, u, v); });
    }
}

void StaticQuadrics::intersect(RayPacket& packet, const PacketMask& valid) const {
    trace(packet, valid, [&](const Entry& entry, unsigned i, float t, float u, float v) {
        packet.tfar[i] = t, packet.u[i] = u, packet.v[i] = v;
        packet.prim[i] = 0, packet.geom[i] = entry.geometry, packet.inst[i] = kNone;
    });
}

void StaticQuadrics::occluded(RayPacket& packet, const PacketMask& valid) const {
    trace(packet, valid, [&](const Entry&, unsigned i, float, float, float) { packet.tfar[i] = -kInfinity; });
}

void StaticQuadrics::extend(Box3f& box) const {
    for (const Entry& entry : m_entries)
        box.extendBy(entry.box);
}

} // namespace strobe
