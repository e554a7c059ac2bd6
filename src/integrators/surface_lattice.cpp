#include "integrators/surface_lattice.h"

#include "core/hash.h"

#include <bit>

namespace strobe {

namespace {

constexpr int kMaxDivide = 20;

/// The exponent of the power of two that cuts `length` into parts no longer than `block`.
int divisionFor(float length, float block) {
    if (!(length > block))
        return 0;
    return std::min(int(std::ceil(std::log2(length / block))), kMaxDivide);
}

/// The length of `edge` as seen along the unit direction d, in scene units.
float seenLength(const V3f& edge, const V3f& d) { return length(edge - d * dot(d, edge)); }

uint64_t nonZero(uint64_t key) { return key ? key : 1; }

enum KeyKind : uint64_t { kVertexKey = 1, kSurfaceKey = 2 };

float smallestStretch(const M44f& m) {
    float smallest = kInfinity;
    for (int i = 0; i < 3; ++i)
        smallest = std::min(smallest, length(V3f(m[i][0], m[i][1], m[i][2])));
    return smallest;
}

} // namespace

SurfaceLattice::SurfaceLattice(const Scene& scene, float blockSize)
    : m_scene(scene), m_blockSize(blockSize), m_cone(scene.camera().cone(V2f(0))) {
    for (const Group& group : scene.groups())
        for (const Geometry& geometry : group.geometries)
            if (const TriangleMesh* mesh = geometry.placed.shape.mesh.get())
                m_clusters.try_emplace(mesh, *mesh);
}

const M44f* SurfaceLattice::transformOf(const Hit& hit, const PlacedShape& placed, float time,
                                        M44f& storage) const {
    if (hit.instance != kNone)
        storage = placed.toParent * m_scene.instances()[hit.instance].motion->at(time);
    else if (placed.shape.mesh)
        return nullptr;
    else
        storage = placed.toParent;
    return &storage;
}

Stencil SurfaceLattice::stencil(const VisibilitySample& sample) const {
    const PlacedShape& placed = m_scene.geometry(sample.hit).placed;
    const RayCone cone = m_scene.camera().cone(sample.film);
    const float block = m_blockSize * (cone.width + sample.hit.t * cone.spread);
    M44f storage;
    const M44f* toWorld = transformOf(sample.hit, placed, sample.ray.time, storage);
    return placed.shape.mesh ? meshStencil(placed, sample, toWorld, block)
                             : quadricStencil(placed, sample, *toWorld, block);
}

Stencil SurfaceLattice::meshStencil(const PlacedShape& placed, const VisibilitySample& sample,
                                    const M44f* toWorld, float block) const {
    const TriangleMesh& mesh = *placed.shape.mesh;
    V3f p[3];
    triangleVertices(mesh, sample.hit.prim, sample.ray.time, p);
    V3f e1 = p[1] - p[0], e2 = p[2] - p[0];
    if (toWorld)
        e1 = transformVector(*toWorld, e1), e2 = transformVector(*toWorld, e2);
    const V3f& d = sample.ray.d;
    const LatticePoint at{sample.hit, dot(cross(e1, e2), d) < 0, 0};
    const float l1 = seenLength(e1, d), l2 = seenLength(e2, d), l3 = seenLength(e2 - e1, d);
    if (std::max(l1, std::max(l2, l3)) <= block) // seen edge-on, a triangle is small whatever its area
        return clusterStencil(mesh, at, toWorld ? block / smallestStretch(*toWorld) : block);
    int divideU = divisionFor(l1, block), divideV = divisionFor(l2, block);
    if (const int third = divisionFor(l3, block); third > std::max(divideU, divideV))
        (divideU >= divideV ? divideU : divideV) = third;
    return triangleStencil(mesh, at, divideU, divideV);
}

Stencil SurfaceLattice::clusterStencil(const TriangleMesh& mesh, const LatticePoint& at, float block) const {
    const VertexClusters& clusters = m_clusters.at(&mesh);
    const int level = clusters.levelFor(block);
    const uint32_t* index = &mesh.indices[3 * size_t(at.hit.prim)];
    Stencil s;
    s.count = 3;
    for (int k = 0; k < 3; ++k)
        s.points[k] = vertexPoint(mesh, at, clusters.representative(index[k], level));
    s.weights[0] = 1 - at.hit.u - at.hit.v;
    s.weights[1] = at.hit.u;
    s.weights[2] = at.hit.v;
    return s;
}

Stencil SurfaceLattice::triangleStencil(const TriangleMesh& mesh, const LatticePoint& at, int divideU,
                                        int divideV) const {
    const float nu = float(1 << divideU), nv = float(1 << divideV);
    const float x = std::max(at.hit.u, 0.f) * nu, y = std::max(at.hit.v, 0.f) * nv;
    const float i = std::min(std::floor(x), nu - 1), j = std::min(std::floor(y), nv - 1);
    const float fx = std::min(x - i, 1.f), fy = std::min(y - j, 1.f);
    // The cell's half that the hit is in: the diagonal runs as the triangle's third edge does.
    const bool upper = fx + fy > 1;
    const float corners[3][2] = {{i + (upper ? 1 : 0), j + (upper ? 1 : 0)}, {i + 1, j}, {i, j + 1}};
    Stencil s;
    s.count = 3;
    s.weights[0] = upper ? fx + fy - 1 : 1 - fx - fy;
    s.weights[1] = upper ? 1 - fy : fx;
    s.weights[2] = upper ? 1 - fx : fy;
    for (int k = 0; k < 3; ++k) {
        float u = corners[k][0] / nu, v = corners[k][1] / nv;
        if (u + v > 1) { // beyond the third edge, where divisions differ: the edge's nearest point stands in
            const float scale = 1 / (u + v);
            u *= scale, v *= scale;
        }
        if (u == 0 && v == 0)
            s.points[k] = cornerPoint(mesh, at, 0);
        else if (u == 1)
            s.points[k] = cornerPoint(mesh, at, 1);
        else if (v == 1)
            s.points[k] = cornerPoint(mesh, at, 2);
        else
            s.points[k] = innerPoint(at, u, v);
    }
    return s;
}

Stencil SurfaceLattice::quadricStencil(const PlacedShape& placed, const VisibilitySample& sample,
                                       const M44f& toWorld, float block) const {
    const QuadricPoint q = placed.shape.quadric->point(sample.hit.u, sample.hit.v);
    const V3f du = transformVector(toWorld, q.dpdu), dv = transformVector(toWorld, q.dpdv);
    const V3f& d = sample.ray.d;
    const V3f n = transformNormal(toWorld.inverse(), q.n);
    const LatticePoint at{sample.hit, dot(n, d) < 0, 0};
    const float nu = float(1 << divisionFor(seenLength(du, d), block));
    const float nv = float(1 << divisionFor(seenLength(dv, d), block));
    const float x = std::clamp(at.hit.u, 0.f, 1.f) * nu, y = std::clamp(at.hit.v, 0.f, 1.f) * nv;
    const float i = std::min(std::floor(x), nu - 1), j = std::min(std::floor(y), nv - 1);
    const float fx = x - i, fy = y - j;
    Stencil s;
    s.count = 4;
    for (int k = 0; k < 4; ++k) {
        const float ox = float(k & 1), oy = float(k >> 1);
        s.points[k] = innerPoint(at, (i + ox) / nu, (j + oy) / nv);
        s.weights[k] = (ox > 0 ? fx : 1 - fx) * (oy > 0 ? fy : 1 - fy);
    }
    return s;
}

LatticePoint SurfaceLattice::vertexPoint(const TriangleMesh& mesh, const LatticePoint& at,
                                         uint32_t vertex) const {
    LatticePoint point = at;
    point.hit.prim = m_clusters.at(&mesh).triangleOf(vertex);
    const uint32_t* index = &mesh.indices[3 * size_t(point.hit.prim)];
    point.hit.u = index[1] == vertex ? 1.f : 0.f;
    point.hit.v = index[2] == vertex ? 1.f : 0.f;
    point.key = nonZero(hashOf(kVertexKey, at.hit.instance, at.hit.geometry, vertex, at.positive));
    return point;
}

LatticePoint SurfaceLattice::cornerPoint(const TriangleMesh& mesh, const LatticePoint& at, int corner) const {
    if (!mesh.normals.empty())
        return vertexPoint(mesh, at, mesh.indices[3 * size_t(at.hit.prim) + size_t(corner)]);
    // Flat triangles do not share their corners' shading.
    return innerPoint(at, corner == 1 ? 1.f : 0.f, corner == 2 ? 1.f : 0.f);
}

LatticePoint SurfaceLattice::innerPoint(const LatticePoint& at, float u, float v) const {
    LatticePoint point = at;
    point.hit.u = u;
    point.hit.v = v;
    point.key = nonZero(hashOf(kSurfaceKey, at.hit.instance, at.hit.geometry, at.hit.prim,
                               std::bit_cast<uint32_t>(u), std::bit_cast<uint32_t>(v), at.positive));
    return point;
}

V3f SurfaceLattice::rawNormal(const LatticePoint& point, float time) const {
    const PlacedShape& placed = m_scene.geometry(point.hit).placed;
    M44f storage;
    const M44f* toWorld = transformOf(point.hit, placed, time, storage);
    if (!placed.shape.mesh)
        return normalize(
            transformNormal(toWorld->inverse(), placed.shape.quadric->point(point.hit.u, point.hit.v).n));
    V3f p[3];
    triangleVertices(*placed.shape.mesh, point.hit.prim, time, p);
    V3f e1 = p[1] - p[0], e2 = p[2] - p[0];
    if (toWorld)
        e1 = transformVector(*toWorld, e1), e2 = transformVector(*toWorld, e2);
    return normalize(cross(e1, e2));
}

ShadingRequest SurfaceLattice::request(const LatticePoint& point, float time) const {
    // A point beyond the silhouette is shaded as if seen at a grazing angle from the side that the sample
    // saw.
    constexpr float kGrazing = 0.02f;
    const V3f p = m_scene.surface(point.hit, time).p;
    const V3f n = rawNormal(point, time) * (point.positive ? 1.f : -1.f);
    const V3f to = p - m_scene.camera().position(time);
    const float distance = length(to);
    V3f wo = normalize(-to);
    if (const float cosine = dot(wo, n); cosine < kGrazing)
        wo = normalize(wo + n * (kGrazing - cosine));
    ShadingRequest request{};
    request.hit = point.hit;
    request.hit.t = distance;
    request.ray = {p + wo * distance, -wo, time, 0};
    request.cone = m_cone;
    return request;
}

} // namespace strobe
