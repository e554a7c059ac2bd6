// Shapes for tests of area lights, independent of src/shapes, and brute-force ray intersection.
#pragma once

#include "core/interfaces/light.h"
#include "core/math/sampling.h"

#include <vector>

namespace strobe::test {

/// A full sphere around the origin.
class TestSphere : public Quadric {
  public:
    explicit TestSphere(float radius) : m_r(radius) {}
    Box3f bounds() const override { return {V3f(-m_r), V3f(m_r)}; }
    bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                   float& v) const override {
        const Imath::V3d od(o), dd(d);
        const double a = dd.dot(dd), b = od.dot(dd), c = od.dot(od) - double(m_r) * m_r, disc = b * b - a * c;
        if (disc < 0)
            return false;
        for (const double root : {(-b - std::sqrt(disc)) / a, (-b + std::sqrt(disc)) / a})
            if (root > tmin && root < tmax) {
                const V3f p = o + d * float(root);
                t = float(root);
                u = std::atan2(p.y, p.x);
                v = std::clamp(p.z / m_r, -1.f, 1.f);
                return true;
            }
        return false;
    }
    QuadricPoint point(float u, float v) const override {
        const float s = safeSqrt(1 - v * v);
        const V3f n(s * std::cos(u), s * std::sin(u), v);
        return {n * m_r, n, {}, {}, {}};
    }
    float area() const override { return 4 * kPi * m_r * m_r; }
    QuadricPoint samplePoint(const V2f& u) const override {
        const V3f n = uniformSphere(u);
        return {n * m_r, n, {}, {}, {}};
    }
    float wholeSphereRadius() const override { return m_r; }

  private:
    float m_r;
};

/// A disk at z = 0.5 with normal +z and an optional hole.
class TestDisk : public Quadric {
  public:
    explicit TestDisk(float radius, float inner = 0) : m_r(radius), m_inner(inner) {}
    Box3f bounds() const override { return {V3f(-m_r, -m_r, .5f), V3f(m_r, m_r, .5f)}; }
    bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                   float& v) const override {
        t = (.5f - o.z) / d.z;
        if (!(t > tmin && t < tmax))
            return false;
        u = o.x + t * d.x;
        v = o.y + t * d.y;
        const float r2 = u * u + v * v;
        return r2 <= m_r * m_r && r2 >= m_inner * m_inner;
    }
    QuadricPoint point(float u, float v) const override { return {{u, v, .5f}, {0, 0, 1}, {}, {}, {}}; }
    float area() const override { return kPi * (m_r * m_r - m_inner * m_inner); }
    QuadricPoint samplePoint(const V2f& u) const override {
        const float r = std::sqrt(lerp(m_inner * m_inner, m_r * m_r, u.x)), phi = 2 * kPi * u.y;
        return point(r * std::cos(phi), r * std::sin(phi));
    }

  private:
    float m_r, m_inner;
};

inline PlacedShape placed(std::shared_ptr<const Quadric> quadric, const M44f& toParent = {},
                          std::shared_ptr<const Motion> motion = nullptr, bool reverse = false) {
    return {{nullptr, std::move(quadric)}, toParent, std::move(motion), reverse};
}
inline PlacedShape placed(TriangleMesh mesh, const M44f& toParent = {},
                          std::shared_ptr<const Motion> motion = nullptr, bool reverse = false) {
    return {{std::make_shared<TriangleMesh>(std::move(mesh)), nullptr}, toParent, std::move(motion), reverse};
}

/// Returns the square [-1,1]² at z = 0 with normal +z.
inline TriangleMesh squareMesh() {
    TriangleMesh m;
    m.positions = {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}};
    m.indices = {0, 1, 2, 0, 2, 3};
    return m;
}
/// Returns an irregular tetrahedron with outward normals.
inline TriangleMesh tetrahedronMesh() {
    TriangleMesh m;
    m.positions = {{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {.2f, .3f, 1.5f}}};
    m.indices = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    return m;
}

inline M44f translate(const V3f& t) {
    M44f m;
    m.setTranslation(t);
    return m;
}
inline M44f scale(const V3f& s) {
    M44f m;
    m.setScale(s);
    return m;
}
inline M44f rotate(const V3f& axis, float degrees) {
    M44f m;
    m.setAxisAngle(axis, radians(degrees));
    return m;
}
/// Returns a motion through `keys` (object-to-world) at equidistant times of the shutter.
inline std::shared_ptr<const Motion> motion(std::vector<M44f> keys) {
    std::vector<float> times;
    for (size_t i = 0; i < keys.size(); ++i)
        times.push_back(float(i) / float(keys.size() - 1));
    const KeyedTransform t(times, keys, MotionConvention::ObjectToWorld);
    return std::make_shared<Motion>(TransformChain(t), Shutter{0, 1}, Box3f(V3f(-2), V3f(2)), 1e-3f);
}

/// Returns all hits of a ray with the shape, with the surface normal as the renderer defines it.
inline std::vector<LightHit> allHits(const PlacedShape& shape, const V3f& p, const V3f& wi, float time) {
    std::vector<LightHit> hits;
    const M44f m = shape.toWorld(time), inverse = m.inverse();
    const float side = shape.reverseOrientation ? -1.f : 1.f;
    const V3f o = transformPoint(inverse, p), d = transformVector(inverse, wi);
    if (shape.shape.quadric) {
        float t = 0, u, v;
        for (float tmin = 1e-6f; shape.shape.quadric->intersect(o, d, tmin, kInfinity, t, u, v);
             tmin = t * 1.0001f) {
            const QuadricPoint q = shape.shape.quadric->point(u, v);
            hits.push_back({transformPoint(m, q.p), normalize(transformNormal(inverse, q.n)) * side, t, 0});
        }
        return hits;
    }
    const TriangleMesh& mesh = *shape.shape.mesh;
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim) {
        V3f v[3];
        triangleVertices(mesh, prim, time, v);
        const V3f e1 = v[1] - v[0], e2 = v[2] - v[0], n = cross(e1, e2);
        const float det = -dot(n, d);
        const V3f s = o - v[0], q = cross(s, d);
        const float t = dot(n, s) / det, b1 = dot(q, e2) / det, b2 = -dot(q, e1) / det;
        if (!(t > 1e-6f && b1 >= 0 && b2 >= 0 && b1 + b2 <= 1))
            continue;
        V3f ng = normalize(transformNormal(inverse, n));
        if (!mesh.normals.empty()) {
            const uint32_t* index = &mesh.indices[3 * size_t(prim)];
            const std::vector<V3f>& normals = mesh.normals[0];
            const V3f ns =
                normals[index[0]] * (1 - b1 - b2) + normals[index[1]] * b1 + normals[index[2]] * b2;
            if (dot(transformNormal(inverse, ns), ng) < 0)
                ng = -ng;
        }
        hits.push_back({p + wi * t, ng * side, t, prim});
    }
    return hits;
}

} // namespace strobe::test
