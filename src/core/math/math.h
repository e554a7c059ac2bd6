// Vectors, matrices, colors and frames, based on Imath.
#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace strobe {

using Imath::Box3f;
using Imath::M44f;
using Imath::Quatf;
using Imath::V2f;
using Imath::V2i;
using Imath::V3f;
/// Linear RGB: radiance, reflectance or any other tristimulus value.
using Rgb = Imath::C3f;

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// The largest float below 1: the maximum of every random number.
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;

inline float dot(const V3f& a, const V3f& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3f cross(const V3f& a, const V3f& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float absDot(const V3f& a, const V3f& b) { return std::abs(dot(a, b)); }
inline float length2(const V3f& v) { return dot(v, v); }
inline float length(const V3f& v) { return std::sqrt(length2(v)); }
/// Returns `v` scaled to unit length; returns a zero vector unchanged.
inline V3f normalize(const V3f& v) {
    const float l2 = length2(v);
    return l2 > 0 ? v * (1 / std::sqrt(l2)) : v;
}
/// Returns `v` scaled to unit length, also where its squared length overflows or underflows, as that of a
/// cross product may.
inline V3f normalizeAny(const V3f& v) {
    const float largest = std::max(std::max(std::abs(v.x), std::abs(v.y)), std::max(std::abs(v.z), 1e-37f));
    return normalize(v * (1 / largest));
}
inline float lerp(float a, float b, float t) { return (1 - t) * a + t * b; }
inline V3f lerp(const V3f& a, const V3f& b, float t) { return a * (1 - t) + b * t; }
inline float sqr(float x) { return x * x; }
inline float safeSqrt(float x) { return std::sqrt(std::max(x, 0.f)); }
inline float radians(float degrees) { return degrees * (kPi / 180); }

// Matrices follow Imath: row vectors, p' = p * M, and `A * B` applies A first. pbrt's `Transform` directive
// lists the sixteen elements in Imath's order.

/// Returns the point `p` transformed by `m`.
inline V3f transformPoint(const M44f& m, const V3f& p) {
    return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
            p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
            p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}
/// Returns the vector `v` transformed by `m`, without its translation.
inline V3f transformVector(const M44f& m, const V3f& v) {
    return {v.x * m[0][0] + v.y * m[1][0] + v.z * m[2][0], v.x * m[0][1] + v.y * m[1][1] + v.z * m[2][1],
            v.x * m[0][2] + v.y * m[1][2] + v.z * m[2][2]};
}
/// Returns the normal `n` transformed by a matrix, given the *inverse* of that matrix; not normalized.
inline V3f transformNormal(const M44f& inverse, const V3f& n) {
    return {n.x * inverse[0][0] + n.y * inverse[0][1] + n.z * inverse[0][2],
            n.x * inverse[1][0] + n.y * inverse[1][1] + n.z * inverse[1][2],
            n.x * inverse[2][0] + n.y * inverse[2][1] + n.z * inverse[2][2]};
}
/// Returns the determinant of the upper left 3x3 matrix.
inline float determinant3(const M44f& m) {
    return dot(V3f(m[0][0], m[0][1], m[0][2]),
               cross(V3f(m[1][0], m[1][1], m[1][2]), V3f(m[2][0], m[2][1], m[2][2])));
}

/// An orthonormal frame; the local axes x, y, z are `s`, `t`, `n`.
struct Frame {
    V3f s, t, n;

    /// Returns a frame around the unit vector `n` (Duff et al. 2017, "Building an Orthonormal Basis,
    /// Revisited").
    static Frame fromNormal(const V3f& n) {
        const float sign = std::copysign(1.f, n.z);
        const float a = -1 / (sign + n.z), b = n.x * n.y * a;
        return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
    }
    /// Returns a frame around the unit vector `n` whose s is `tangent` made orthogonal to n; fromNormal(n) if
    /// `tangent` is zero, parallel to n, or not finite.
    static Frame fromNormalTangent(const V3f& n, const V3f& tangent) {
        const V3f s = tangent - n * dot(n, tangent);
        const float l2 = length2(s);
        if (!(l2 > 1e-12f * length2(tangent)) || !std::isfinite(l2)) // also true for NaN
            return fromNormal(n);
        const V3f unit = s * (1 / std::sqrt(l2));
        return {unit, cross(n, unit), n};
    }
    V3f toLocal(const V3f& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
    V3f toWorld(const V3f& v) const { return s * v.x + t * v.y + n * v.z; }
};

/// Returns the luminance of `c`, with pbrt's weights for Rec. 709.
inline float luminance(const Rgb& c) { return 0.212671f * c.x + 0.715160f * c.y + 0.072169f * c.z; }
/// Returns the root mean square of the components. Samples whose density is proportional to it have the least
/// sum of the components' variances.
inline float rootMeanSquare(const Rgb& c) { return std::sqrt((c.x * c.x + c.y * c.y + c.z * c.z) / 3); }
inline float maxComponent(const Rgb& c) { return std::max(c.x, std::max(c.y, c.z)); }
inline bool isBlack(const Rgb& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline bool isFinite(const Rgb& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

} // namespace strobe
