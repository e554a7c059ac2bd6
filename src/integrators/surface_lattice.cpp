#include "integrators/surface_lattice.h"

#include "core/hash.h"

#include <bit>

namespace strobe {

namespace {

constexpr int kMaxDivide = 20;

/// The exponent of the power of two that cuts a length into parts no longer than a block; both are given
/// squared. Half the binary logarithm of their ratio, rounded up: read off the number's exponent.
int divisionFor(float length2, float block2) {
    const float ratio = length2 / block2;
    if (!(ratio > 1))
        return 0;
    const uint32_t bits = std::bit_cast<uint32_t>(ratio);
    const int ceilLog2 = int(bits >> 23) - 127 + ((bits & 0x7fffff) != 0);
    return std::min((ceilLog2 + 1) / 2, kMaxDivide);
}

/// The squared length of `edge` as seen along the unit direction d, in scene units.
float seenLength2(const V3f& edge, const V3f& d) { return std::max(length2(edge) - sqr(dot(d, edge)), 0.f); }

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

const M44f* SurfaceLattice::transformOf(uint32_t instance, const PlacedShape& placed, float time,
                                        M44f& storage) const {
    if (instance != kNone)
        storage = placed.toParent * m_scene.instances()[instance].motion->at(time);
    else if (placed.shape.mesh)
        return nullptr;
    else
        storage = placed.toParent;
    return &storage;
}

void SurfaceLattice::stencil(const VisibilitySample& sample, Stencil& out) const {
    const Hit& hit = sample.hit;
    const PlacedShape& placed = m_scene.geometry(hit).placed;
    const RayCone cone = m_scene.camera().cone(sample.film);
    const float block = m_blockSize * (cone.width + hit.t * cone.spread);
    out.face = {hit.instance, hit.geometry, true};
    M44f storage;
    const M44f* toWorld = transformOf(hit.instance, placed, sample.ray.time, storage);
    if (placed.shape.mesh)
        meshStencil(placed, sample, toWorld, block, out);
    else
        quadricStencil(placed, sample, *toWorld, block, out);
}

namespace {

/// Two edges of a triangle from its first vertex, in world space.
struct Edges {
    V3f a, b;
    Edges(const TriangleMesh& mesh, uint32_t prim, float time, const M44f* toWorld) {
        V3f p[3];
        triangleVertices(mesh, prim, time, p);
        a = p[1] - p[0], b = p[2] - p[0];
        if (toWorld)
            a = transformVector(*toWorld, a), b = transformVector(*toWorld, b);
    }
};

/// Keys of the points of one primitive, and side.
class PointKeys {
  public:
    PointKeys(const LatticeFace& face, uint32_t prim)
        : m_base(hashOf(kSurfaceKey, uint64_t(face.instance) << 32 | face.geometry,
                        uint64_t(prim) << 1 | face.positive)),
          m_prim(prim) {}
    LatticePoint at(float u, float v) const {
        const uint64_t uv = uint64_t(std::bit_cast<uint32_t>(u)) << 32 | std::bit_cast<uint32_t>(v);
        return {nonZero(hashCombine(m_base, uv)), m_prim, u, v};
    }

  private:
    uint64_t m_base;
    uint32_t m_prim;
};

} // namespace

void SurfaceLattice::meshStencil(const PlacedShape& placed, const VisibilitySample& sample,
                                 const M44f* toWorld, float block, Stencil& out) const {
    const TriangleMesh& mesh = *placed.shape.mesh;
    const Edges e(mesh, sample.hit.prim, sample.ray.time, toWorld);
    const V3f& d = sample.ray.d;
    out.face.positive = dot(cross(e.a, e.b), d) < 0;
    const float block2 = block * block;
    const float a = seenLength2(e.a, d), b = seenLength2(e.b, d), c = seenLength2(e.b - e.a, d);
    if (std::max(a, std::max(b, c)) <= block2) // seen edge-on, a triangle is small whatever its area
        return clusterStencil(mesh, sample.hit, toWorld ? block / smallestStretch(*toWorld) : block, out);
    int divideU = divisionFor(a, block2), divideV = divisionFor(b, block2);
    if (const int third = divisionFor(c, block2); third > std::max(divideU, divideV))
        (divideU >= divideV ? divideU : divideV) = third;
    triangleStencil(mesh, sample.hit, divideU, divideV, out);
}

void SurfaceLattice::clusterStencil(const TriangleMesh& mesh, const Hit& hit, float block,
                                    Stencil& out) const {
    const VertexClusters& clusters = m_clusters.at(&mesh);
    const int level = clusters.levelFor(block);
    const uint32_t* index = &mesh.indices[3 * size_t(hit.prim)];
    out.count = 3;
    for (int k = 0; k < 3; ++k)
        out.points[k] = vertexPoint(mesh, clusters, out.face, clusters.representative(index[k], level));
    out.weights[0] = std::max(1 - hit.u - hit.v, 0.f);
    out.weights[1] = hit.u;
    out.weights[2] = hit.v;
}

void SurfaceLattice::triangleStencil(const TriangleMesh& mesh, const Hit& hit, int divideU, int divideV,
                                     Stencil& out) const {
    const float nu = float(1 << divideU), nv = float(1 << divideV);
    const float x = std::max(hit.u, 0.f) * nu, y = std::max(hit.v, 0.f) * nv;
    const float i = std::min(std::floor(x), nu - 1), j = std::min(std::floor(y), nv - 1);
    const float fx = std::min(x - i, 1.f), fy = std::min(y - j, 1.f);
    // The cell's half that the hit is in: the diagonal runs as the triangle's third edge does.
    const float upper = fx + fy > 1 ? 1 : 0;
    out.count = 3;
    out.weights[0] = std::abs(1 - fx - fy);
    out.weights[1] = upper > 0 ? 1 - fy : fx;
    out.weights[2] = upper > 0 ? 1 - fx : fy;
    const float corners[3][2] = {{i + upper, j + upper}, {i + 1, j}, {i, j + 1}};
    const PointKeys keys(out.face, hit.prim);
    for (int k = 0; k < 3; ++k) {
        float u = corners[k][0] / nu, v = corners[k][1] / nv;
        if (u + v > 1) { // beyond the third edge, where divisions differ: the edge's nearest point stands in
            const float scale = 1 / (u + v);
            u *= scale, v *= scale;
        }
        const int corner = u == 0 && v == 0 ? 0 : u == 1 ? 1 : v == 1 ? 2 : -1;
        // Corners of flat triangles are not shared: the neighbours' normals differ.
        out.points[k] = corner >= 0 && !mesh.normals.empty()
                            ? vertexPoint(mesh, m_clusters.at(&mesh), out.face,
                                          mesh.indices[3 * size_t(hit.prim) + size_t(corner)])
                            : keys.at(u, v);
    }
}

void SurfaceLattice::quadricStencil(const PlacedShape& placed, const VisibilitySample& sample,
                                    const M44f& toWorld, float block, Stencil& out) const {
    const Hit& hit = sample.hit;
    const QuadricPoint q = placed.shape.quadric->point(hit.u, hit.v);
    const V3f& d = sample.ray.d;
    out.face.positive = dot(rawNormal(placed, hit, &toWorld, sample.ray.time), d) < 0;
    const float block2 = block * block;
    const float nu = float(1 << divisionFor(seenLength2(transformVector(toWorld, q.dpdu), d), block2));
    const float nv = float(1 << divisionFor(seenLength2(transformVector(toWorld, q.dpdv), d), block2));
    const float x = std::clamp(hit.u, 0.f, 1.f) * nu, y = std::clamp(hit.v, 0.f, 1.f) * nv;
    const float i = std::min(std::floor(x), nu - 1), j = std::min(std::floor(y), nv - 1);
    const float fx = x - i, fy = y - j;
    const PointKeys keys(out.face, hit.prim);
    out.count = 4;
    for (int k = 0; k < 4; ++k) {
        const float ox = float(k & 1), oy = float(k >> 1);
        out.points[k] = keys.at((i + ox) / nu, (j + oy) / nv);
        out.weights[k] = (ox > 0 ? fx : 1 - fx) * (oy > 0 ? fy : 1 - fy);
    }
}

LatticePoint SurfaceLattice::vertexPoint(const TriangleMesh& mesh, const VertexClusters& clusters,
                                         const LatticeFace& face, uint32_t vertex) const {
    const uint32_t prim = clusters.triangleOf(vertex);
    const uint32_t* index = &mesh.indices[3 * size_t(prim)];
    const uint64_t key = hashOf(kVertexKey, uint64_t(face.instance) << 32 | face.geometry,
                                uint64_t(vertex) << 1 | face.positive);
    return {nonZero(key), prim, index[1] == vertex ? 1.f : 0.f, index[2] == vertex ? 1.f : 0.f};
}

V3f SurfaceLattice::rawNormal(const PlacedShape& placed, const Hit& hit, const M44f* toWorld,
                              float time) const {
    if (placed.shape.mesh) {
        const Edges e(*placed.shape.mesh, hit.prim, time, toWorld);
        return normalize(cross(e.a, e.b));
    }
    return normalize(transformNormal(toWorld->inverse(), placed.shape.quadric->point(hit.u, hit.v).n));
}

ShadingRequest SurfaceLattice::request(const LatticeFace& face, const LatticePoint& point, float time) const {
    // A point beyond the silhouette is shaded as if seen at a grazing angle from the side that the sample
    // saw.
    constexpr float kGrazing = 0.02f;
    ShadingRequest request{};
    request.hit = {face.instance, face.geometry, point.prim, point.u, point.v, 0};
    const PlacedShape& placed = m_scene.geometry(request.hit).placed;
    M44f storage;
    const M44f* toWorld = transformOf(face.instance, placed, time, storage);
    const V3f n = rawNormal(placed, request.hit, toWorld, time) * (face.positive ? 1.f : -1.f);
    const V3f p = m_scene.surface(request.hit, time).p;
    const V3f to = p - m_scene.camera().position(time);
    request.hit.t = length(to);
    V3f wo = normalize(-to);
    if (const float cosine = dot(wo, n); cosine < kGrazing)
        wo = normalize(wo + n * (kGrazing - cosine));
    request.ray = {p + wo * request.hit.t, -wo, time, 0};
    request.cone = m_cone;
    return request;
}

} // namespace strobe
