// The division of a primitive into lattice cells, for one hit. Branch-free, for loops over structures of
// arrays.
#pragma once

#include "core/math/math.h"

#include <bit>

namespace strobe {

/// An edge is divided into at most 2^kMaxDivision segments.
inline constexpr int kMaxDivision = 20;
/// Edges whose squared length, in blocks, is below this are not divided.
inline constexpr float kUndividedLength2 = 2;

/// Returns the exponent of the power of two that divides an edge into segments between 1/√2 and √2 blocks
/// long. `length4` is the fourth power of the edge's length in blocks. A quarter of its binary logarithm,
/// rounded, is read off the exponent of the float.
inline int divisionFor(float length4) {
    const int floorLog2 = int(std::bit_cast<uint32_t>(length4) >> 23) - 127;
    const int division = std::min(((floorLog2 >> 1) + 1) >> 1, kMaxDivision);
    return length4 >= sqr(kUndividedLength2) ? division : 0;
}

/// Returns the smallest exponent k >= 0 with (2^k)² > n2, at most kMaxDivision.
inline int divisionAbove(float n2) { return divisionFor(sqr(2 * n2)); }

/// Returns the squared length of `edge` projected along the unit direction d, in scene units.
inline float projectedLength2(const V3f& edge, const V3f& d) {
    return std::max(length2(edge) - sqr(dot(d, edge)), 0.f);
}

/// Returns the squared sine of the angle between the sides of a parallelogram, at least 1/4. `a2` and `b2`
/// are the squared lengths of the sides, `area2` is the squared area. For a parallelogram to have the area of
/// a block, its sides must be longer than those of the block by the square root of the inverse sine.
inline float clampedSine2(float a2, float b2, float area2) {
    return a2 * b2 < 4 * area2 ? std::min(area2 / (a2 * b2), 1.f) : .25f;
}

/// A position in a grid of `nu` columns and `nv` rows over the (u, v) of a primitive.
struct GridPosition {
    float i, j;   ///< column and row of the grid cell
    float nu, nv; ///< integers
    float x, y;   ///< in the grid cell, in [0,1]
};

/// Returns 2^division.
inline float segmentCount(int division) { return std::bit_cast<float>(uint32_t(127 + division) << 23); }

/// Returns the position of (u, v), clamped to [0,1]², in a grid of nu x nv cells.
inline GridPosition gridPosition(float u, float v, float nu, float nv) {
    GridPosition r;
    r.nu = nu;
    r.nv = nv;
    const float x = std::clamp(u, 0.f, 1.f) * nu, y = std::clamp(v, 0.f, 1.f) * nv;
    r.i = std::min(float(int(x)), nu - 1);
    r.j = std::min(float(int(y)), nv - 1);
    r.x = x - r.i;
    r.y = y - r.j;
    return r;
}
/// Returns whether a position of a triangle is in the upper triangle of its grid cell, beyond the diagonal.
inline bool isInUpperTriangle(const GridPosition& p) { return 1 - p.x - p.y < 0; }

/// A hit of a triangle that is divided for the block size at the hit.
struct DividedTriangle {
    GridPosition position;
    float facing;  ///< negative if the ray sees the front: the side of the normal cross(a, b)
    float normal2; ///< squared length of that normal; the length is twice the area of the triangle
    bool isUpper;  ///< see isInUpperTriangle
    bool isSmall;  ///< all projected edges are too short to be divided
};

/// Returns the division at the hit of a ray of unit direction d with barycentrics (u, v) of the second and
/// third vertex. `a` and `b` are the edges from the first vertex, `blockSize` is in scene units.
inline DividedTriangle divideTriangle(const V3f& a, const V3f& b, const V3f& d, float u, float v,
                                      float blockSize) {
    const V3f normal = cross(a, b);
    const float facing = dot(normal, d), block2 = sqr(blockSize);
    const float a2 = projectedLength2(a, d), b2 = projectedLength2(b, d), c2 = projectedLength2(b - a, d);
    const float sine2 = clampedSine2(a2, b2, sqr(facing)), perBlock2 = 1 / block2;
    const int divisionU = divisionFor(sqr(a2 * perBlock2) * sine2);
    const int divisionV = divisionFor(sqr(b2 * perBlock2) * sine2);
    const GridPosition position = gridPosition(u, v, segmentCount(divisionU), segmentCount(divisionV));
    // The projected edges decide, not the area: edges along the ray may be long.
    const bool isSmall = std::max(std::max(a2, b2), c2) < kUndividedLength2 * block2;
    return {position, facing, length2(normal), isInUpperTriangle(position), isSmall};
}

} // namespace strobe
