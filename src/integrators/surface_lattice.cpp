#include "integrators/surface_lattice.h"

#include "core/hash.h"

#include <bit>

namespace strobe {

namespace {

constexpr int kMaxDivide = 20;
/// Squared lengths, in blocks, below which an edge is not divided.
constexpr float kUndivided = 2;

/// The exponent of the power of two that cuts a length into parts as long as a block, to a factor of the root
/// of two; both are given squared. Half the binary logarithm of their ratio, rounded: read off the number's
/// exponent.
int divisionFor(float length2, float block2) {
    const float ratio = length2 / block2;
    if (!(ratio >= kUndivided))
        return 0;
    const int floorLog2 = int(std::bit_cast<uint32_t>(ratio) >> 23) - 127;
    return std::min((floorLog2 + 1) / 2, kMaxDivide);
}

/// The exponent of the least power of two whose square is above n2, or one.
int divisionAbove(float n2) { return divisionFor(2 * n2, 1); }

/// The squared length of `edge` as seen along the unit direction d, in scene units.
float seenLength2(const V3f& edge, const V3f& d) { return std::max(length2(edge) - sqr(dot(d, edge)), 0.f); }

/// How much longer than a block's the sides of its parallelogram must be, squared, for it to have a block's
/// area as seen along d: the inverse sine of the angle between them, at most 2. The squared lengths as seen
/// are a2 and b2.
float slantOf(float a2, float b2, const V3f& a, const V3f& b, const V3f& d) {
    const float area2 = sqr(dot(cross(a, b), d));
    return a2 * b2 < 4 * area2 ? std::sqrt(a2 * b2 / area2) : 2;
}

uint64_t nonZero(uint64_t key) { return key ? key : 1; }

// What a key is of. Keys of cells and of points are never compared.
enum KeyKind : uint64_t { kVertexKey = 1, kSurfaceKey = 2, kGridKey = 3, kCellKey = 4 };

/// A shade stands for a block: textures are filtered over as much, but never over less than a pixel.
RayCone coneOfBlock(const Camera& camera, float blockSize) {
    const RayCone pixel = camera.cone(V2f(0));
    const float scale = std::max(blockSize, 1.f);
    return {pixel.width * scale, pixel.spread * scale};
}

} // namespace

SurfaceLattice::SurfaceLattice(const Scene& scene, float blockSize, SmallTriangles small)
    : m_scene(scene), m_blockSize(blockSize), m_sharesSmall(small == SmallTriangles::Shared),
      m_cone(coneOfBlock(scene.camera(), blockSize)) {
    if (!m_sharesSmall)
        return;
    for (const Group& group : scene.groups())
        for (const Geometry& geometry : group.geometries)
            if (const TriangleMesh* mesh = geometry.placed.shape.mesh.get())
                m_cells.try_emplace(mesh, *mesh);
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

LatticeCell SurfaceLattice::locate(const VisibilitySample& sample, const RayCone& cone, uint32_t bin) const {
    const Hit& hit = sample.hit;
    const PlacedShape& placed = m_scene.geometry(hit).placed;
    const float block = m_blockSize * (cone.width + hit.t * cone.spread);
    LatticeCell cell;
    cell.face = {hit.instance, hit.geometry, true};
    cell.prim = hit.prim;
    M44f storage;
    const M44f* toWorld = transformOf(hit.instance, placed, sample.ray.time, storage);
    if (placed.shape.mesh)
        locateOnMesh(placed, sample, toWorld, block, bin, cell);
    else
        locateOnQuadric(placed, sample, *toWorld, block, bin, cell);
    return cell;
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

uint64_t faceNumber(const LatticeFace& face) { return uint64_t(face.instance) << 32 | face.geometry; }
uint64_t itemNumber(const LatticeFace& face, uint32_t item, uint64_t kind) {
    return uint64_t(item) << 8 | kind << 1 | face.positive;
}

uint64_t floatBits(float a, float b) {
    return uint64_t(std::bit_cast<uint32_t>(a)) << 32 | std::bit_cast<uint32_t>(b);
}

/// Sets the cell's mesh from a division of (u, v); returns the place inside it, in [0,1]².
V2f divide(LatticeCell& cell, float u, float v, int divideU, int divideV) {
    cell.nu = float(1 << divideU), cell.nv = float(1 << divideV);
    const float x = std::clamp(u, 0.f, 1.f) * cell.nu, y = std::clamp(v, 0.f, 1.f) * cell.nv;
    cell.i = std::min(float(int(x)), cell.nu - 1), cell.j = std::min(float(int(y)), cell.nv - 1);
    return {x - cell.i, y - cell.j};
}

void setKey(LatticeCell& cell, uint32_t bin) {
    const uint64_t kind = kCellKey + uint64_t(cell.kind);
    cell.key = nonZero(quickHashOf(faceNumber(cell.face), itemNumber(cell.face, cell.prim, kind),
                                   floatBits(cell.i, cell.j), floatBits(cell.nu, cell.nv), bin));
}

LatticePoint innerPoint(const LatticeFace& face, uint32_t prim, float u, float v, uint32_t bin) {
    const uint64_t item = itemNumber(face, prim, kSurfaceKey);
    return {nonZero(quickHashOf(faceNumber(face), item, floatBits(u, v), bin)), prim, u, v};
}

} // namespace

void SurfaceLattice::locateOnMesh(const PlacedShape& placed, const VisibilitySample& sample,
                                  const M44f* toWorld, float block, uint32_t bin, LatticeCell& cell) const {
    const TriangleMesh& mesh = *placed.shape.mesh;
    const Edges e(mesh, sample.hit.prim, sample.ray.time, toWorld);
    const V3f& d = sample.ray.d;
    cell.face.positive = dot(cross(e.a, e.b), d) < 0;
    cell.count = 3;
    const float block2 = block * block;
    const float a = seenLength2(e.a, d), b = seenLength2(e.b, d), c = seenLength2(e.b - e.a, d);
    const float u = sample.hit.u, v = sample.hit.v;
    if (m_sharesSmall && std::max({a, b, c}) < kUndivided * block2) // edge-on, it is small whatever its area
        return locateAmongSmall(mesh, sample.hit, 2 * block2 / length(cross(e.a, e.b)), bin, cell);
    const float slant = slantOf(a, b, e.a, e.b, d);
    const V2f f = divide(cell, u, v, divisionFor(a, slant * block2), divisionFor(b, slant * block2));
    const float rest = 1 - f.x - f.y, beyond = std::min(rest, 0.f); // negative in the upper triangle
    cell.kind = rest < 0 ? LatticeCell::Upper : LatticeCell::Lower;
    cell.weights[0] = std::abs(rest), cell.weights[1] = f.x + beyond, cell.weights[2] = f.y + beyond;
    setKey(cell, bin);
}

void SurfaceLattice::locateAmongSmall(const TriangleMesh& mesh, const Hit& hit, float cellArea, uint32_t bin,
                                      LatticeCell& cell) const {
    const float u = std::max(hit.u, 0.f), v = std::max(hit.v, 0.f);
    if (m_cells.at(&mesh).surround(hit.prim, u, v, cellArea, cell.lowest, cell.weights)) {
        const MeshCell& lowest = cell.lowest;
        cell.kind = LatticeCell::Grid;
        cell.count = 8;
        const uint32_t item = uint32_t(lowest.level << 3 | lowest.direction);
        cell.key =
            nonZero(quickHashOf(faceNumber(cell.face), itemNumber(cell.face, item, kGridKey),
                                uint64_t(uint32_t(lowest.x)) << 32 | uint32_t(lowest.y), lowest.z, bin));
        return;
    }
    cell.kind = LatticeCell::Vertices;
    cell.i = cell.j = cell.nu = cell.nv = 0;
    cell.weights[0] = std::max(1 - u - v, 0.f), cell.weights[1] = u, cell.weights[2] = v;
    setKey(cell, bin);
}

void SurfaceLattice::locateOnQuadric(const PlacedShape& placed, const VisibilitySample& sample,
                                     const M44f& toWorld, float block, uint32_t bin,
                                     LatticeCell& cell) const {
    const Hit& hit = sample.hit;
    const QuadricPoint q = placed.shape.quadric->point(hit.u, hit.v);
    const V3f& d = sample.ray.d;
    cell.face.positive = dot(rawNormal(placed, hit, &toWorld, sample.ray.time), d) < 0;
    cell.kind = LatticeCell::Rectangle;
    cell.count = 4;
    const float block2 = block * block;
    const V3f du = transformVector(toWorld, q.dpdu), dv = transformVector(toWorld, q.dpdv);
    const float a = seenLength2(du, d), b = seenLength2(dv, d);
    const float slant2 = slantOf(a, b, du, dv, d) * block2, u = length(du) / block, v = length(dv) / block;
    // What is seen edge-on here turns to face us further along: neither side of a cell bows by more than half
    // a block, nor do the ends of one turn apart by more. Both numbers go at most once around.
    constexpr float kTurn = 2 * kPi;
    const int divideV = std::max(divisionFor(b, slant2), divisionAbove(kTurn * v));
    const float apart = 2 * kTurn * std::ldexp(v, -divideV);
    const int divideU =
        std::max({divisionFor(a, slant2), divisionAbove(kTurn * u), divisionAbove(sqr(apart))});
    const V2f f = divide(cell, hit.u, hit.v, divideU, divideV);
    for (int k = 0; k < 4; ++k)
        cell.weights[k] = (k & 1 ? f.x : 1 - f.x) * (k >> 1 ? f.y : 1 - f.y);
    setKey(cell, bin);
}

void SurfaceLattice::points(const LatticeCell& cell, uint32_t bin,
                            LatticePoint out[LatticeCell::kPoints]) const {
    const TriangleMesh* mesh =
        m_scene.geometry({cell.face.instance, cell.face.geometry, 0, 0, 0, 0}).placed.shape.mesh.get();
    const auto inner = [&](float u, float v) { return innerPoint(cell.face, cell.prim, u, v, bin); };
    if (cell.kind == LatticeCell::Rectangle) {
        for (int k = 0; k < 4; ++k)
            out[k] = inner((cell.i + float(k & 1)) / cell.nu, (cell.j + float(k >> 1)) / cell.nv);
        return;
    }
    if (cell.kind == LatticeCell::Grid)
        return gridPoints(*mesh, cell, bin, out);
    const uint32_t* index = &mesh->indices[3 * size_t(cell.prim)];
    if (cell.kind == LatticeCell::Vertices) {
        for (int k = 0; k < 3; ++k)
            out[k] = vertexPoint(*mesh, cell.face, index[k], bin);
        return;
    }
    const float upper = cell.kind == LatticeCell::Upper ? 1.f : 0.f;
    const float corners[3][2] = {
        {cell.i + upper, cell.j + upper}, {cell.i + 1, cell.j}, {cell.i, cell.j + 1}};
    for (int k = 0; k < 3; ++k) {
        float u = corners[k][0] / cell.nu, v = corners[k][1] / cell.nv;
        if (u + v > 1) // beyond the third edge, where divisions differ: the finer one's points on it stand in
            (cell.nu < cell.nv ? u : v) = 1 - (cell.nu < cell.nv ? v : u);
        const int corner = u == 0 && v == 0 ? 0 : u == 1 ? 1 : v == 1 ? 2 : -1;
        // Corners of flat triangles are not shared: the neighbours' normals differ.
        out[k] = corner >= 0 && !mesh->normals.empty() ? vertexPoint(*mesh, cell.face, index[corner], bin)
                                                       : inner(u, v);
    }
}

void SurfaceLattice::gridPoints(const TriangleMesh& mesh, const LatticeCell& cell, uint32_t bin,
                                LatticePoint out[8]) const {
    std::optional<MeshPlace> places[8];
    m_cells.at(&mesh).places(cell.lowest, places);
    for (int k = 0; k < 8; ++k)
        out[k] = places[k] ? innerPoint(cell.face, places[k]->prim, places[k]->u, places[k]->v, bin)
                           : LatticePoint{0, 0, 0, 0};
}

LatticePoint SurfaceLattice::vertexPoint(const TriangleMesh& mesh, const LatticeFace& face, uint32_t vertex,
                                         uint32_t bin) const {
    const uint32_t prim = m_cells.at(&mesh).triangleOf(vertex);
    const uint32_t* index = &mesh.indices[3 * size_t(prim)];
    const uint64_t key = quickHashOf(faceNumber(face), itemNumber(face, vertex, kVertexKey), 0, bin);
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

ShadingRequest SurfaceLattice::request(const LatticeFace& face, const LatticePoint& point, float time,
                                       const V2f& lens) const {
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
    const V3f to = p - m_scene.camera().viewpoint(p, lens, time);
    request.hit.t = length(to);
    V3f wo = normalize(-to);
    if (const float cosine = dot(wo, n); cosine < kGrazing)
        wo = normalize(wo + n * (kGrazing - cosine));
    request.ray = {p + wo * request.hit.t, -wo, time, 0};
    request.cone = m_cone;
    return request;
}

} // namespace strobe
