#include "lattice/surface_lattice.h"

namespace strobe {

SurfaceLattice::SurfaceLattice(const Scene& scene, float blockSize, SmallTriangles small)
    : m_scene(scene), m_blockSize(blockSize), m_sharesSmall(small == SmallTriangles::Shared) {
    if (!m_sharesSmall)
        return;
    for (uint32_t group = 0; group < scene.groups().size(); ++group) {
        std::vector<const MeshCells*>& cells = m_meshCells.emplace_back();
        for (uint32_t i = 0; const Geometry& geometry : scene.groups()[group].geometries) {
            const auto pointQuery = [&tracer = scene.tracer(), group,
                                     i](const V3f& p, float radius,
                                        const Tracer::PointQueryVisitor& visitor) {
                tracer.pointQuery(group, i, p, radius, visitor);
            };
            const TriangleMesh* mesh = geometry.placed.shape.mesh.get();
            cells.push_back(mesh ? &m_cellsOfMesh.try_emplace(mesh, *mesh, pointQuery).first->second
                                 : nullptr);
            ++i;
        }
    }
}

void SurfaceLattice::computePixelCones(std::span<const PixelRef> pixels, std::vector<RayCone>& cones) const {
    cones.resize(pixels.size());
    V2SoA film;
    RayConeSoA chunk;
    for (size_t first = 0; first < pixels.size(); first += kSoAWidth) {
        const int n = int(std::min<size_t>(kSoAWidth, pixels.size() - first));
        for (int i = 0; i < n; ++i) {
            const PixelRef& pixel = pixels[first + size_t(i)];
            film.set(i, {float(pixel.x) + 0.5f, float(pixel.y) + 0.5f});
        }
        m_scene.camera().coneSoA(film, n, chunk.width, chunk.spread);
        for (int i = 0; i < n; ++i)
            cones[first + size_t(i)] = {chunk.width[i], chunk.spread[i]};
    }
}

namespace {

uint64_t sideKeySum(const SurfaceSide& side) { return surfaceKeySum(side.instance, side.geometry); }

/// Returns the part of the keys of cells and points that depends on geometry and primitive.
uint64_t primitiveKeySum(uint64_t surfaceKeySum, uint32_t prim) {
    return appendFastHash<1>(surfaceKeySum, latticeKeyItem(prim, 0, false));
}

LatticePoint surfacePoint(const SurfaceSide& side, uint32_t prim, float u, float v) {
    const uint64_t item = latticeKeyItem(prim, kSurfaceKey, side.isFront);
    return {prim, u, v, false, appendFastHash<1>(sideKeySum(side), item, latticeFloatBits(u, v))};
}

LatticePoint vertexPoint(const SurfaceSide& side, uint32_t vertex) {
    const uint64_t item = latticeKeyItem(vertex, kVertexKey, side.isFront);
    return {vertex, 0, 0, true, appendFastHash<1>(sideKeySum(side), item)};
}

/// Returns whether all hits are on one geometry.
STROBE_TARGET_CLONES bool hitOneGeometry(const HitSoA& hit, int n) {
    uint32_t differences = 0;
    for (int i = 0; i < n; ++i)
        differences |= (hit.geometry[i] ^ hit.geometry[0]) | (hit.instance[i] ^ hit.instance[0]);
    return differences == 0;
}

/// Returns whether all hits are on one primitive.
STROBE_TARGET_CLONES bool hitOnePrimitive(const HitSoA& hit, int n) {
    uint32_t differences = 0;
    for (int i = 0; i < n; ++i)
        differences |= (hit.prim[i] ^ hit.prim[0]) | (hit.geometry[i] ^ hit.geometry[0]) |
                       (hit.instance[i] ^ hit.instance[0]);
    return differences == 0;
}

/// Transforms the edges of all hits of a surface to world space.
STROBE_TARGET_CLONES void transformEdges(LatticeHitSoA& hits, const LatticeSurface& surface) {
    const int n = hits.count;
    const uint32_t instance = surface.instance, geometry = surface.geometry;
    const M44f m = surface.toWorld;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const bool isOnSurface = (hits.hit.instance[i] == instance) & (hits.hit.geometry[i] == geometry);
        Edges e{hits.a.at(i), hits.b.at(i)};
        e.transform(m);
        hits.a.x[i] = isOnSurface ? e.a.x : hits.a.x[i];
        hits.a.y[i] = isOnSurface ? e.a.y : hits.a.y[i];
        hits.a.z[i] = isOnSurface ? e.a.z : hits.a.z[i];
        hits.b.x[i] = isOnSurface ? e.b.x : hits.b.x[i];
        hits.b.y[i] = isOnSurface ? e.b.y : hits.b.y[i];
        hits.b.z[i] = isOnSurface ? e.b.z : hits.b.z[i];
        hits.needsTransform[i] = isOnSurface ? 0 : hits.needsTransform[i];
    }
}

STROBE_TARGET_CLONES void computeKeySums(LatticeHitSoA& hits, uint64_t surfaceKeySum) {
    const int n = hits.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        hits.keySum[i] = primitiveKeySum(surfaceKeySum, hits.hit.prim[i]);
}

/// SurfaceLattice::fetchSurfaces for hits that are all on one mesh with fixed directions.
void fetchMesh(LatticeHitSoA& hits, const LatticeSurface& surface) {
    for (int i = 0; i < hits.count; ++i) {
        const Edges edges = surface.meshEdges(hits.hit.prim[i]);
        hits.a.set(i, edges.a);
        hits.b.set(i, edges.b);
    }
    if (surface.motion)
        transformEdges(hits, surface);
    computeKeySums(hits, surface.keySum);
}

} // namespace

/// Writes the surfaces' part of LatticeHitSoA. Returns whether there are quadrics.
bool SurfaceLattice::fetchSurfaces(LatticeHitSoA& hits, SurfaceCache& surfaces) const {
    if (hitOneGeometry(hits.hit, hits.count)) {
        const LatticeSurface& surface = surfaces.surfaceOf(hits.hit, 0);
        if (surface.hasFixedDirections && surface.mesh) {
            fetchMesh(hits, surface);
            return false;
        }
    }
    bool anyNeedsTransform = false, anyQuadric = false;
    for (int i = 0; i < hits.count; ++i) {
        const LatticeSurface& surface = surfaces.surfaceOf(hits.hit, i);
        const uint32_t prim = hits.hit.prim[i];
        Edges edges;
        hits.isQuadric[i] = !surface.mesh;
        anyQuadric |= !surface.mesh;
        const bool needsTransform = surface.hasFixedDirections && surface.mesh && surface.motion;
        hits.needsTransform[i] = needsTransform;
        anyNeedsTransform |= needsTransform;
        if (!surface.mesh)
            hits.seesQuadricFront[i] =
                surface.computeQuadricEdges(hits.hit.at(i), hits.d.at(i), hits.time[i], edges);
        else if (surface.hasFixedDirections)
            edges = surface.meshEdges(prim);
        else
            edges = surface.worldEdgesAt(prim, hits.time[i]);
        hits.a.set(i, edges.a);
        hits.b.set(i, edges.b);
        hits.keySum[i] = primitiveKeySum(surface.keySum, prim);
    }
    for (int i = 0; anyNeedsTransform && i < hits.count; ++i)
        if (hits.needsTransform[i])
            transformEdges(hits, surfaces.surfaceOf(hits.hit, i));
    return anyQuadric;
}

bool SurfaceLattice::findCommonTriangle(const HitSoA& hits, int count, SurfaceCache& surfaces,
                                        LatticePatch& patch) const {
    if (hits.geometry[0] == kNone || !hitOnePrimitive(hits, count))
        return false;
    const LatticeSurface& surface = surfaces.surfaceOf(hits, 0);
    if (!surface.hasFixedDirections || !surface.mesh)
        return false;
    patch.instance = surface.instance;
    patch.geometry = surface.geometry;
    patch.prim = hits.prim[0];
    patch.keySum = primitiveKeySum(surface.keySum, patch.prim);
    return true;
}

bool SurfaceLattice::findCommonDivision(const VisibilitySoA& samples, int count, const RayConeSoA& cones,
                                        SurfaceCache& surfaces, LatticePatch& patch) const {
    const Edges edges = surfaces.surfaceOf(samples.hit, 0).worldEdges(patch.prim);
    return patch.findDivision(samples, count, edges, cones, m_blockSize, m_sharesSmall);
}

void SurfaceLattice::locate(LatticeHitSoA& hits, SurfaceCache& surfaces) const {
    const bool anyQuadric = fetchSurfaces(hits, surfaces);
    const bool anySmall = hits.divideTriangles(m_blockSize, m_sharesSmall);
    for (int i = 0; anyQuadric && i < hits.count; ++i)
        if (hits.isQuadric[i])
            hits.divideQuadric(i);
    hits.computeKeys();
    if (anySmall)
        findMeshCells(hits, surfaces);
}

/// Turns cells of kind Vertices into Grid where the mesh has more vertices than mesh cells.
void SurfaceLattice::findMeshCells(LatticeHitSoA& hits, SurfaceCache& surfaces) const {
    int32_t small[kSoAWidth];
    int smallCount = 0;
    for (int i = 0; i < hits.count; ++i) {
        small[smallCount] = i;
        smallCount += hits.kind[i] == LatticeCell::Vertices;
    }
    MeshCellSoA& queries = hits.meshCells;
    int32_t hitOfQuery[kSoAWidth];
    queries.count = 0;
    for (int k = 0; k < smallCount; ++k) {
        const int i = small[k];
        const LatticeSurface& surface = surfaces.surfaceOf(hits.hit, i);
        if (sqr(hits.blockSize[i]) < surface.minBlockArea) // true for most: saves the query
            continue;
        hitOfQuery[queries.count] = i;
        surface.cells->appendQuery(hits.hit.prim[i], hits.coords.x[i], hits.coords.y[i],
                                   sqr(hits.blockSize[i]), hits.normal2[i], queries);
    }
    if (queries.count == 0)
        return;
    queries.surround();
    for (int q = 0; q < queries.count; ++q) {
        if (!queries.isUsable[q])
            continue;
        const int i = hitOfQuery[q];
        const MeshCell lowest = queries.lowest(q);
        const uint32_t item = uint32_t(lowest.level << 3 | lowest.direction);
        hits.kind[i] = LatticeCell::Grid;
        hits.meshCell[i] = q;
        hits.coords.set(i, queries.coords.at(q));
        hits.key[i] =
            mix64(appendFastHash<1>(surfaceKeySum(hits.hit.instance[i], hits.hit.geometry[i]),
                                    latticeKeyItem(item, kGridKey, hits.isFront[i]),
                                    uint64_t(uint32_t(lowest.x)) << 32 | uint32_t(lowest.y), lowest.z));
    }
}

LatticeCell SurfaceLattice::cellOf(const LatticeHitSoA& hits, int i) {
    LatticeCell cell;
    cell.key = hits.key[i];
    cell.side = {hits.hit.instance[i], hits.hit.geometry[i], bool(hits.isFront[i])};
    cell.prim = hits.hit.prim[i];
    cell.kind = LatticeCell::Kind(hits.kind[i]);
    cell.lowest = cell.kind == LatticeCell::Grid ? hits.meshCells.lowest(hits.meshCell[i]) : MeshCell{};
    cell.i = hits.i[i];
    cell.j = hits.j[i];
    cell.nu = hits.nu[i];
    cell.nv = hits.nv[i];
    return cell;
}

namespace {

void findGridPoints(const MeshCells& cells, const LatticeCell& cell, MeshPointCache& cache,
                    LatticePoint out[8]) {
    std::optional<MeshPoint> points[8];
    cells.findPoints(cell.lowest, cache, points);
    for (int k = 0; k < 8; ++k)
        out[k] =
            points[k] ? surfacePoint(cell.side, points[k]->prim, points[k]->u, points[k]->v) : LatticePoint();
}

} // namespace

void SurfaceLattice::findPoints(const LatticeCell& cell, MeshPointCache& cache,
                                LatticePoint out[LatticeCell::kMaxPoints]) const {
    const SurfaceSide& side = cell.side;
    switch (cell.kind) {
    case LatticeCell::Vertices: {
        const uint32_t* index = &meshOf(side).indices[3 * size_t(cell.prim)];
        for (int k = 0; k < 3; ++k)
            out[k] = vertexPoint(side, index[k]);
        return;
    }
    case LatticeCell::Grid:
        findGridPoints(meshCellsOf(side), cell, cache, out);
        return;
    case LatticeCell::Rectangle:
        for (int k = 0; k < 4; ++k)
            out[k] = surfacePoint(side, cell.prim, (cell.i + float(k & 1)) / cell.nu,
                                  (cell.j + float(k >> 1)) / cell.nv);
        return;
    case LatticeCell::Lower:
    case LatticeCell::Upper:
        break;
    }
    LatticeHitSoA hits;
    hits.count = 1;
    hits.hit.set(0, {side.instance, side.geometry, cell.prim, 0, 0, 0});
    hits.kind[0] = cell.kind;
    hits.isFront[0] = side.isFront;
    hits.i[0] = cell.i;
    hits.j[0] = cell.j;
    hits.nu[0] = cell.nu;
    hits.nv[0] = cell.nv;
    hits.keySum[0] = primitiveKeySum(sideKeySum(side), cell.prim);
    TriangleCellSoA cells;
    cells.push_back(hits, 0);
    findPoints(hits.hit, cells, 3);
    for (int k = 0; k < 3; ++k)
        out[k] = cells.points[k].at(0);
}

void SurfaceLattice::findPoints(const HitSoA& hits, TriangleCellSoA& cells, int pointsPerCell) const {
    cells.computePoints(pointsPerCell);
    for (int k = 0; k < pointsPerCell; ++k)
        for (int c = 0; c < cells.count; ++c)
            if (cells.points[k].corner[c] >= 0)
                findSharedVertex(hits, cells, cells.points[k], c);
}

/// Point number c is at a vertex of its triangle. Meshes with normals share it; otherwise sets `corner`
/// negative.
void SurfaceLattice::findSharedVertex(const HitSoA& hits, const TriangleCellSoA& cells,
                                      TriangleCellSoA::Points& points, int c) const {
    const int h = cells.hit[c];
    const SurfaceSide side{hits.instance[h], hits.geometry[h], bool(cells.isFront[c])};
    const TriangleMesh& mesh = meshOf(side);
    if (mesh.normals.empty()) {
        points.corner[c] = -1;
        return;
    }
    const LatticePoint vertex =
        vertexPoint(side, mesh.indices[3 * size_t(hits.prim[h]) + size_t(points.corner[c])]);
    points.prim[c] = vertex.prim;
    points.keySum[c] = vertex.keySum;
}

} // namespace strobe
