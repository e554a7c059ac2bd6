// How a primitive is divided at a hit, for loops over lanes.
#pragma once

#include "core/math/math.h"

#include <bit>

namespace strobe {

inline constexpr int kMaxDivide = 20;
/// Squared lengths, in blocks, below which an edge is not divided.
inline constexpr float kUndivided = 2;

/// The exponent of the power of two that cuts a length into parts of about 1, to a factor of the root of two.
/// Given is the length's fourth power, a quarter of whose binary logarithm, rounded, is read off the number's
/// exponent.
inline int divisionFor(float length4) {
    const int floorLog2 = int(std::bit_cast<uint32_t>(length4) >> 23) - 127;
    const int division = std::min(((floorLog2 >> 1) + 1) >> 1, kMaxDivide);
    return length4 >= sqr(kUndivided) ? division : 0;
}

/// The exponent of the least power of two whose square is above n2, or one.
inline int divisionAbove(float n2) { return divisionFor(sqr(2 * n2)); }

/// The squared length of `edge` as seen along the unit direction d, in scene units.
inline float seenLength2(const V3f& edge, const V3f& d) {
    return std::max(length2(edge) - sqr(dot(d, edge)), 0.f);
}

/// The squared sine of the angle between the sides of a parallelogram, at least a quarter; given are their
/// squared lengths and its squared area. For it to have a block's area, its sides must be longer than a
/// block's by the root of the sine's inverse.
inline float sine2Of(float a2, float b2, float area2) {
    return a2 * b2 < 4 * area2 ? std::min(area2 / (a2 * b2), 1.f) : .25f;
}

/// A place in a mesh of divided u and v.
struct Divided {
    float i, j, nu, nv; ///< see LatticeCell
    float x, y;         ///< inside, in [0,1]
};

/// How many parts a division makes.
inline float partsOf(int division) { return std::bit_cast<float>(uint32_t(127 + division) << 23); }

inline Divided divideBy(float u, float v, float nu, float nv) {
    Divided r;
    r.nu = nu, r.nv = nv;
    const float x = std::clamp(u, 0.f, 1.f) * nu, y = std::clamp(v, 0.f, 1.f) * nv;
    r.i = std::min(float(int(x)), nu - 1), r.j = std::min(float(int(y)), nv - 1);
    r.x = x - r.i, r.y = y - r.j;
    return r;
}
inline Divided divide(float u, float v, int divideU, int divideV) {
    return divideBy(u, v, partsOf(divideU), partsOf(divideV));
}
/// Whether a place of a triangle is in the upper half of the parallelogram.
inline bool isUpper(const Divided& at) { return 1 - at.x - at.y < 0; }

/// Where a hit lies in a triangle divided by blocks.
struct DividedTriangle {
    Divided at;
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
    const float sine2 = sine2Of(a2, b2, sqr(facing)), perBlock2 = 1 / block2;
    const Divided at =
        divide(u, v, divisionFor(sqr(a2 * perBlock2) * sine2), divisionFor(sqr(b2 * perBlock2) * sine2));
    // Edge-on, a triangle is small whatever its area.
    return {at, facing, length2(normal), isUpper(at), std::max(std::max(a2, b2), c2) < kUndivided * block2};
}

} // namespace strobe
