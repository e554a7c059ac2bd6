// Formulas for points on surfaces. The scalar and the SoA code share them, so that both give the same bits;
// they are branch-free, so that loops over them vectorize.
#pragma once

#include "core/interfaces/geometry.h"
#include "core/math/soa.h"

namespace strobe {

STROBE_FORCE_INLINE float maxAbsComponent(const V3f& v) {
    return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z)));
}

/// An affine transform: an M44f without its last column, which is (0, 0, 0, 1). Points are row vectors.
struct Affine {
    V3f x, y, z, o; ///< rows: the images of the axes and of the origin

    STROBE_FORCE_INLINE explicit Affine(const M44f& m)
        : x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]),
          o(m[3][0], m[3][1], m[3][2]) {}
    STROBE_FORCE_INLINE Affine(const V3f& ax, const V3f& ay, const V3f& az, const V3f& origin)
        : x(ax), y(ay), z(az), o(origin) {}

    STROBE_FORCE_INLINE V3f point(const V3f& p) const { return x * p.x + y * p.y + z * p.z + o; }
    STROBE_FORCE_INLINE V3f vector(const V3f& v) const { return x * v.x + y * v.y + z * v.z; }
    /// Returns a normal transformed by the inverse transpose, computed as the cofactors over the determinant.
    /// Division by the determinant, not by its sign only: else normals of tiny instances underflow.
    STROBE_FORCE_INLINE V3f normal(const V3f& n) const {
        const V3f yz = cross(y, z);
        const float determinant = dot(x, yz), inverse = 1 / determinant;
        const float factor = determinant != 0 ? inverse : 1.f;
        return (yz * n.x + cross(z, x) * n.y + cross(x, y) * n.z) * factor;
    }
    /// Returns RawSurfacePoint::scale after the transform, given its value `s` before.
    STROBE_FORCE_INLINE float scale(float s) const {
        return s * std::max(maxAbsComponent(x), std::max(maxAbsComponent(y), maxAbsComponent(z))) +
               maxAbsComponent(o);
    }
};

/// A triangle in any space.
struct Triangle {
    V3f a, b, c;

    STROBE_FORCE_INLINE V3f point(float u, float v) const { return a * (1 - u - v) + b * u + c * v; }
    /// Not normalized.
    STROBE_FORCE_INLINE V3f normal() const { return cross(b - a, c - a); }
    /// See RawSurfacePoint::scale.
    STROBE_FORCE_INLINE float scale() const {
        return std::max(maxAbsComponent(a), std::max(maxAbsComponent(b), maxAbsComponent(c)));
    }
    /// Writes dp/du and dp/dv, given the texture coordinates of the vertices; zero if these are degenerate.
    STROBE_FORCE_INLINE void derivatives(const V2f& uvA, const V2f& uvB, const V2f& uvC, V3f& dpdu,
                                         V3f& dpdv) const {
        const V2f duv02 = uvA - uvC, duv12 = uvB - uvC;
        const V3f dp02 = a - c, dp12 = b - c;
        const float det = duv02.x * duv12.y - duv02.y * duv12.x, inverse = 1 / det;
        const float factor = std::abs(det) < 1e-20f ? 0.f : inverse;
        dpdu = (dp02 * duv12.y - dp12 * duv02.y) * factor;
        dpdv = (dp12 * duv02.x - dp02 * duv12.x) * factor;
    }
};

/// Returns a triangle of a mesh in object space, at shutter fraction `time`.
inline Triangle triangleOf(const TriangleMesh& mesh, uint32_t prim, float time) {
    V3f v[3];
    triangleVertices(mesh, prim, time, v);
    return {v[0], v[1], v[2]};
}

/// Returns the interpolated vertex normal at barycentrics (u, v), not normalized. The mesh has normals.
inline V3f interpolatedNormal(const TriangleMesh& mesh, uint32_t prim, float u, float v, float time) {
    const uint32_t* index = &mesh.indices[3 * size_t(prim)];
    const auto interpolate = [&](const std::vector<V3f>& normals) {
        return Triangle{normals[index[0]], normals[index[1]], normals[index[2]]}.point(u, v);
    };
    if (mesh.normals.size() == 1)
        return interpolate(mesh.normals[0]);
    const float x = time * float(mesh.normals.size() - 1);
    const size_t i = std::min(size_t(std::max(x, 0.f)), mesh.normals.size() - 2);
    return lerp(interpolate(mesh.normals[i]), interpolate(mesh.normals[i + 1]), x - float(i));
}

/// Returns RawSurfacePoint::scale of points on a quadric. The factor 4 covers the closed form, which loses
/// more bits than interpolation in a triangle.
inline float quadricScale(const Quadric& quadric) {
    const Box3f box = quadric.bounds();
    return 4 * std::max(maxAbsComponent(box.min), maxAbsComponent(box.max));
}

/// The texture footprint of a ray cone along d, see `footprint`. Zero if d is parallel to the surface, or
/// dp/du and dp/dv are linearly dependent.
struct Footprint {
    V2f duvdx, duvdy;

    STROBE_FORCE_INLINE Footprint(const V3f& ng, const V3f& dpdu, const V3f& dpdv, const V3f& d,
                                  float width) {
        const float cosine = dot(d, ng), n2 = length2(ng); // the length of ng is a factor of both
        const float uu = dot(dpdu, dpdu), uv = dot(dpdu, dpdv), vv = dot(dpdv, dpdv);
        const float det = uu * vv - uv * uv;
        const int32_t exists = (sqr(cosine) > 1e-6f * n2 ? 1 : 0) & (width > 0 ? 1 : 0) & (det > 0 ? 1 : 0);
        // Offsets perpendicular to d are projected along d onto the tangent plane, then expressed in dp/du
        // and dp/dv by least squares.
        const V3f n = ng * (1 / cosine), along = dpdu - n * dot(d, dpdu), across = dpdv - n * dot(d, dpdv);
        const float scale = width / det;
        const V3f toU = (along * vv - across * uv) * scale, toV = (across * uu - along * uv) * scale;
        const Frame frame = Frame::fromNormal(d);
        const float ux = dot(frame.s, toU), vx = dot(frame.s, toV);
        const float uy = dot(frame.t, toU), vy = dot(frame.t, toV);
        duvdx = {exists ? ux : 0.f, exists ? vx : 0.f};
        duvdy = {exists ? uy : 0.f, exists ? vy : 0.f};
    }
};

} // namespace strobe
