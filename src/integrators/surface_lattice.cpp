#include "integrators/surface_lattice.h"

namespace strobe {

namespace {

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
    for (const Group& group : scene.groups()) {
        std::vector<const MeshCells*>& cells = m_cellsOf.emplace_back();
        for (const Geometry& geometry : group.geometries) {
            const TriangleMesh* mesh = geometry.placed.shape.mesh.get();
            cells.push_back(mesh ? &m_cells.try_emplace(mesh, *mesh).first->second : nullptr);
        }
    }
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

namespace {

/// Two edges of a triangle from its first vertex, or the derivatives of a quadric's place.
struct Edges {
    V3f a, b;
    void transform(const M44f& m) { a = transformVector(m, a), b = transformVector(m, b); }
};

Edges edgesOf(const TriangleMesh& mesh, uint32_t prim, float time) {
    V3f p[3];
    triangleVertices(mesh, prim, time, p);
    return {p[1] - p[0], p[2] - p[0]};
}

Edges edgesOf(const Quadric& quadric, const Hit& hit) {
    const QuadricPoint q = quadric.point(hit.u, hit.v);
    return {q.dpdu, q.dpdv};
}

uint64_t faceSum(const LatticeFace& face) {
    return quickSum<0>(kQuickSum, uint64_t(face.instance) << 32 | face.geometry);
}

LatticePoint innerPoint(const LatticeFace& face, uint32_t prim, float u, float v) {
    const uint64_t item = latticeItem(prim, kSurfaceKey, face.positive);
    return {prim, u, v, quickSum<1>(faceSum(face), item, latticeFloatBits(u, v))};
}

LatticePoint vertexPoint(const TriangleMesh& mesh, const MeshCells& cells, const LatticeFace& face,
                         uint32_t vertex) {
    const uint32_t prim = cells.triangleOf(vertex);
    const uint32_t* index = &mesh.indices[3 * size_t(prim)];
    const uint64_t sum = quickSum<1>(faceSum(face), latticeItem(vertex, kVertexKey, face.positive));
    return {prim, index[1] == vertex ? 1.f : 0.f, index[2] == vertex ? 1.f : 0.f, sum};
}

} // namespace

/// What hits of one triangle, or of one quadric, have in common: neighbours often do.
struct SurfaceLattice::Primitive {
    uint32_t instance = kNone, geometry = kNone, prim = 0;
    const PlacedShape* placed;
    const Motion* motion; ///< of its group; null: it rests
    bool isFixed;         ///< `edges` are the world's, at any time and place
    Edges edges;          ///< of what neither deforms nor bends, in its group's space
    uint64_t keySum;

    bool isOf(const Hit& hit) const {
        return hit.prim == prim && hit.geometry == geometry && hit.instance == instance;
    }
};

void SurfaceLattice::find(const Hit& hit, Primitive& p) const {
    p.instance = hit.instance, p.geometry = hit.geometry, p.prim = hit.prim;
    p.placed = &m_scene.geometry(hit).placed;
    p.motion = hit.instance == kNone ? nullptr : m_scene.instances()[hit.instance].motion.get();
    p.keySum = quickSum<1>(faceSum({hit.instance, hit.geometry, false}), latticeItem(hit.prim, 0, false));
    const TriangleMesh* mesh = p.placed->shape.mesh.get();
    p.isFixed = mesh && !mesh->deforms();
    if (!p.isFixed)
        return;
    p.edges = edgesOf(*mesh, hit.prim, 0);
    if (!p.motion)
        return; // the world's own meshes stand where they are
    p.edges.transform(p.placed->toParent);
    p.isFixed = p.motion->isStill();
    if (p.isFixed)
        p.edges.transform(p.motion->at(0));
}

void SurfaceLattice::fetch(LatticeLanes& lanes) const {
    const auto edgesAt = [](const Primitive& p, const Hit& hit, float time) {
        const Shape& shape = p.placed->shape;
        Edges edges = p.edges;
        if (!shape.mesh)
            edges = edgesOf(*shape.quadric, hit);
        else if (shape.mesh->deforms())
            edges = edgesOf(*shape.mesh, hit.prim, time);
        if (!shape.mesh || (p.motion && shape.mesh->deforms()))
            edges.transform(p.placed->toParent);
        if (p.motion)
            edges.transform(p.motion->at(time));
        return edges;
    };
    constexpr uint32_t kRemembered = 16;
    Primitive remembered[kRemembered];
    for (int i = 0; i < lanes.count; ++i) {
        const Hit hit = lanes.hit.at(i);
        Primitive& primitive = remembered[(hit.prim + hit.geometry) % kRemembered];
        if (!primitive.isOf(hit))
            find(hit, primitive);
        const Edges edges = primitive.isFixed ? primitive.edges : edgesAt(primitive, hit, lanes.time[i]);
        lanes.a.set(i, edges.a), lanes.b.set(i, edges.b);
        lanes.keySum[i] = primitive.keySum;
        lanes.bends[i] = !primitive.placed->shape.mesh;
    }
}

void SurfaceLattice::locate(LatticeLanes& lanes) const {
    fetch(lanes);
    lanes.divideTriangles(m_blockSize, m_sharesSmall);
    for (int i = 0; i < lanes.count; ++i)
        if (lanes.bends[i]) {
            const Hit hit = lanes.hit.at(i);
            const PlacedShape& placed = m_scene.geometry(hit).placed;
            M44f storage;
            const M44f* toWorld = transformOf(hit.instance, placed, lanes.time[i], storage);
            const V3f n = rawNormal(placed, hit, toWorld, lanes.time[i]);
            lanes.divideQuadric(i, dot(n, lanes.d.at(i)) < 0);
        }
    lanes.mixKeys();
    findGrids(lanes);
}

/// Small triangles whose vertices are more than blocks share the places of a grid.
void SurfaceLattice::findGrids(LatticeLanes& lanes) const {
    MeshCellLanes& grid = lanes.grid;
    grid.count = 0;
    for (int i = 0; i < lanes.count; ++i)
        if (lanes.kind[i] == LatticeCell::Vertices) {
            lanes.inGrid[i] = grid.count;
            cellsOf(lanes.hit.instance[i], lanes.hit.geometry[i])
                ->ask(lanes.hit.prim[i], lanes.place.x[i], lanes.place.y[i], lanes.cellArea[i], grid);
        }
    if (grid.count == 0)
        return;
    grid.surround();
    for (int i = 0; i < lanes.count; ++i) {
        const int g = lanes.inGrid[i];
        if (lanes.kind[i] != LatticeCell::Vertices || !grid.found[g])
            continue;
        const LatticeFace face{lanes.hit.instance[i], lanes.hit.geometry[i], false};
        const MeshCell lowest = grid.lowest(g);
        const uint32_t item = uint32_t(lowest.level << 3 | lowest.direction);
        lanes.kind[i] = LatticeCell::Grid;
        lanes.place.set(i, grid.place.at(g));
        lanes.key[i] = mix64(quickSum<1>(faceSum(face), latticeItem(item, kGridKey, lanes.positive[i]),
                                         uint64_t(uint32_t(lowest.x)) << 32 | uint32_t(lowest.y), lowest.z));
    }
}

LatticeCell SurfaceLattice::cellAt(const LatticeLanes& lanes, int i) {
    LatticeCell cell{lanes.key[i],
                     {lanes.hit.instance[i], lanes.hit.geometry[i], bool(lanes.positive[i])},
                     lanes.hit.prim[i],
                     LatticeCell::Kind(lanes.kind[i]),
                     {},
                     lanes.i[i],
                     lanes.j[i],
                     lanes.nu[i],
                     lanes.nv[i]};
    if (cell.kind == LatticeCell::Grid)
        cell.lowest = lanes.grid.lowest(lanes.inGrid[i]);
    return cell;
}

void SurfaceLattice::points(const LatticeCell& cell, LatticePoint out[LatticeCell::kPoints]) const {
    const LatticeFace& face = cell.face;
    const auto inner = [&](float u, float v) { return innerPoint(face, cell.prim, u, v); };
    if (cell.kind == LatticeCell::Rectangle) {
        for (int k = 0; k < 4; ++k)
            out[k] = inner((cell.i + float(k & 1)) / cell.nu, (cell.j + float(k >> 1)) / cell.nv);
        return;
    }
    const TriangleMesh& mesh = *m_scene.geometry({face.instance, face.geometry}).placed.shape.mesh;
    const MeshCells& cells = *cellsOf(face.instance, face.geometry);
    if (cell.kind == LatticeCell::Grid)
        return gridPoints(cells, cell, out);
    const uint32_t* index = &mesh.indices[3 * size_t(cell.prim)];
    if (cell.kind == LatticeCell::Vertices) {
        for (int k = 0; k < 3; ++k)
            out[k] = vertexPoint(mesh, cells, face, index[k]);
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
        out[k] = corner >= 0 && !mesh.normals.empty() ? vertexPoint(mesh, cells, face, index[corner])
                                                      : inner(u, v);
    }
}

void SurfaceLattice::gridPoints(const MeshCells& cells, const LatticeCell& cell, LatticePoint out[8]) const {
    std::optional<MeshPlace> places[8];
    cells.places(cell.lowest, places);
    for (int k = 0; k < 8; ++k)
        out[k] =
            places[k] ? innerPoint(cell.face, places[k]->prim, places[k]->u, places[k]->v) : LatticePoint();
}

V3f SurfaceLattice::rawNormal(const PlacedShape& placed, const Hit& hit, const M44f* toWorld,
                              float time) const {
    if (placed.shape.mesh) {
        Edges e = edgesOf(*placed.shape.mesh, hit.prim, time);
        if (toWorld)
            e.transform(*toWorld);
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
