// How a primitive is divided at a hit, for loops over lanes.
#pragma once

#include "core/math.h"

#include <bit>

namespace strobe {

inline constexpr int kMaxDivide = 20;
/// Squared lengths, in blocks, below which an edge is not divided.
inline constexpr float kUndivided = 2;

/// The exponent of the power of two that cuts a length into parts as long as a block, to a factor of the root
/// of two; both are given squared. Half the binary logarithm of their ratio, rounded: read off the number's
/// exponent.
inline int divisionFor(float length2, float block2) {
    const float ratio = length2 / block2;
    const int floorLog2 = int(std::bit_cast<uint32_t>(ratio) >> 23) - 127;
    const int division = std::min((floorLog2 + 1) / 2, kMaxDivide);
    return ratio >= kUndivided ? division : 0;
}

/// The exponent of the least power of two whose square is above n2, or one.
inline int divisionAbove(float n2) { return divisionFor(2 * n2, 1); }

/// The squared length of `edge` as seen along the unit direction d, in scene units.
inline float seenLength2(const V3f& edge, const V3f& d) {
    return std::max(length2(edge) - sqr(dot(d, edge)), 0.f);
}

/// How much longer than a block's the sides of its parallelogram must be, squared, for it to have a block's
/// area as seen: the inverse sine of the angle between them, at most 2. The squared lengths as seen are a2
/// and b2, the squared area `area2`.
inline float slantOf(float a2, float b2, float area2) {
    const float slant = std::sqrt(a2 * b2 / area2);
    return a2 * b2 < 4 * area2 ? slant : 2;
}

/// A place in a mesh of divided u and v.
struct Divided {
    float i, j, nu, nv; ///< see LatticeCell
    float x, y;         ///< inside, in [0,1]
};

inline Divided divide(float u, float v, int divideU, int divideV) {
    Divided r;
    r.nu = std::bit_cast<float>(uint32_t(127 + divideU) << 23);
    r.nv = std::bit_cast<float>(uint32_t(127 + divideV) << 23);
    const float x = std::clamp(u, 0.f, 1.f) * r.nu, y = std::clamp(v, 0.f, 1.f) * r.nv;
    r.i = std::min(float(int(x)), r.nu - 1), r.j = std::min(float(int(y)), r.nv - 1);
    r.x = x - r.i, r.y = y - r.j;
    return r;
}

/// Where a hit lies in a triangle divided by blocks.
struct DividedTriangle {
    Divided at;
    float block2;      ///< the squared size of a block
    float facing;      ///< negative: the ray sees the side of the triangle's own normal
    float normal2;     ///< the squared length of that, which is twice the area
    bool upper, small; ///< in the upper half of a mesh; all edges are seen as less than a block
};

/// The hit of a ray of unit direction d has barycentrics (u, v) in a triangle of edges a and b from its first
/// vertex.
inline DividedTriangle divideTriangle(const V3f& a, const V3f& b, const V3f& d, float u, float v,
                                      float block) {
    const V3f normal = cross(a, b);
    const float facing = dot(normal, d), block2 = sqr(block);
    const float a2 = seenLength2(a, d), b2 = seenLength2(b, d), c2 = seenLength2(b - a, d);
    const float sized2 = block2 * slantOf(a2, b2, sqr(facing));
    const Divided at = divide(u, v, divisionFor(a2, sized2), divisionFor(b2, sized2));
    // Edge-on, a triangle is small whatever its area.
    return {at,
            block2,
            facing,
            length2(normal),
            1 - at.x - at.y < 0,
            std::max(std::max(a2, b2), c2) < kUndivided * block2};
}

} // namespace strobe
