#include "lattice/surface_lattice.h"

namespace strobe {

SurfaceLattice::SurfaceLattice(const Scene& scene, float blockSize, SmallTriangles small)
    : m_scene(scene), m_blockSize(blockSize), m_sharesSmall(small == SmallTriangles::Shared) {
    if (!m_sharesSmall)
        return;
    for (uint32_t group = 0; group < scene.groups().size(); ++group) {
        std::vector<const MeshCells*>& cells = m_cellsOf.emplace_back();
        for (uint32_t i = 0; const Geometry& geometry : scene.groups()[group].geometries) {
            const auto pointQuery = [&tracer = scene.tracer(), group,
                                     i](const V3f& p, float radius, const Tracer::PointQueryVisitor& look) {
                tracer.pointQuery(group, i, p, radius, look);
            };
            const TriangleMesh* mesh = geometry.placed.shape.mesh.get();
            cells.push_back(mesh ? &m_cells.try_emplace(mesh, *mesh, pointQuery).first->second : nullptr);
            ++i;
        }
    }
}

void SurfaceLattice::findCones(std::span<const PixelRef> pixels, std::vector<RayCone>& cones) const {
    cones.resize(pixels.size());
    V2SoA film;
    alignas(64) float width[kSoAWidth], spread[kSoAWidth];
    for (size_t first = 0; first < pixels.size(); first += kSoAWidth) {
        const int n = int(std::min<size_t>(kSoAWidth, pixels.size() - first));
        for (int i = 0; i < n; ++i) {
            const PixelRef& pixel = pixels[first + size_t(i)];
            film.set(i, {float(pixel.x) + 0.5f, float(pixel.y) + 0.5f});
        }
        m_scene.camera().coneSoA(film, n, width, spread);
        for (int i = 0; i < n; ++i)
            cones[first + size_t(i)] = {width[i], spread[i]};
    }
}

namespace {

uint64_t faceSum(const LatticeFace& face) { return surfaceSum(face.instance, face.geometry); }

/// What the keys of cells and points in a primitive have in common.
uint64_t primitiveSum(uint64_t faceSum, uint32_t prim) {
    return quickSum<1>(faceSum, latticeItem(prim, 0, false));
}

LatticePoint innerPoint(const LatticeFace& face, uint32_t prim, float u, float v) {
    const uint64_t item = latticeItem(prim, kSurfaceKey, face.positive);
    return {prim, u, v, false, quickSum<1>(faceSum(face), item, latticeFloatBits(u, v))};
}

LatticePoint vertexPoint(const LatticeFace& face, uint32_t vertex) {
    const uint64_t item = latticeItem(vertex, kVertexKey, face.positive);
    return {vertex, 0, 0, true, quickSum<1>(faceSum(face), item)};
}

} // namespace

namespace {

/// Whether all lanes hit one shape.
STROBE_TARGET_CLONES bool hitOneShape(const HitSoA& hit, int n) {
    uint32_t differences = 0;
    for (int i = 0; i < n; ++i)
        differences |= (hit.geometry[i] ^ hit.geometry[0]) | (hit.instance[i] ^ hit.instance[0]);
    return differences == 0;
}

/// Whether they hit one primitive.
STROBE_TARGET_CLONES bool hitOnePrimitive(const HitSoA& hit, int n) {
    uint32_t differences = 0;
    for (int i = 0; i < n; ++i)
        differences |= (hit.prim[i] ^ hit.prim[0]) | (hit.geometry[i] ^ hit.geometry[0]) |
                       (hit.instance[i] ^ hit.instance[0]);
    return differences == 0;
}

/// Places the edges of all hits of a part in the world.
STROBE_TARGET_CLONES void placeAll(LatticeSoA& l, const LatticeSurface& surface) {
    const int n = l.count;
    const uint32_t instance = surface.instance, geometry = surface.geometry;
    const M44f m = surface.toWorld;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const bool ofPart = (l.hit.instance[i] == instance) & (l.hit.geometry[i] == geometry);
        Edges e{l.a.at(i), l.b.at(i)};
        e.transform(m);
        l.a.x[i] = ofPart ? e.a.x : l.a.x[i], l.a.y[i] = ofPart ? e.a.y : l.a.y[i];
        l.a.z[i] = ofPart ? e.a.z : l.a.z[i];
        l.b.x[i] = ofPart ? e.b.x : l.b.x[i], l.b.y[i] = ofPart ? e.b.y : l.b.y[i];
        l.b.z[i] = ofPart ? e.b.z : l.b.z[i];
        l.toPlace[i] = ofPart ? 0 : l.toPlace[i];
    }
}

STROBE_TARGET_CLONES void setSums(LatticeSoA& l, uint64_t faceSum) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        l.keySum[i] = primitiveSum(faceSum, l.hit.prim[i]);
}

/// All hits are of one mesh, which is fixed.
void fetchFixed(LatticeSoA& l, const LatticeSurface& surface) {
    for (int i = 0; i < l.count; ++i) {
        const Edges edges = surface.keptEdges(l.hit.prim[i]);
        l.a.set(i, edges.a), l.b.set(i, edges.b);
    }
    if (surface.motion)
        placeAll(l, surface);
    setSums(l, surface.keySum);
}

} // namespace

/// Returns whether there are quadrics.
bool SurfaceLattice::fetch(LatticeSoA& lanes, SurfaceCache& surfaces) const {
    if (hitOneShape(lanes.hit, lanes.count)) {
        const LatticeSurface& only = surfaces.of(lanes.hit, 0);
        if (only.isFixed && only.mesh) {
            fetchFixed(lanes, only);
            return false;
        }
    }
    bool anyToPlace = false, anyBends = false;
    for (int i = 0; i < lanes.count; ++i) {
        const LatticeSurface& surface = surfaces.of(lanes.hit, i);
        const uint32_t prim = lanes.hit.prim[i];
        Edges edges;
        lanes.bends[i] = !surface.mesh, anyBends |= !surface.mesh;
        const bool toPlace = surface.isFixed && surface.mesh && surface.motion;
        lanes.toPlace[i] = toPlace, anyToPlace |= toPlace;
        if (!surface.mesh)
            lanes.seesFront[i] = surface.look(lanes.hit.at(i), lanes.d.at(i), lanes.time[i], edges);
        else if (surface.isFixed)
            edges = surface.keptEdges(prim);
        else
            edges = surface.edgesAt(prim, lanes.time[i]);
        lanes.a.set(i, edges.a), lanes.b.set(i, edges.b);
        lanes.keySum[i] = primitiveSum(surface.keySum, prim);
    }
    for (int i = 0; anyToPlace && i < lanes.count; ++i)
        if (lanes.toPlace[i])
            placeAll(lanes, surfaces.of(lanes.hit, i));
    return anyBends;
}

bool SurfaceLattice::findTriangle(const HitSoA& hits, int count, SurfaceCache& surfaces,
                                  LatticePatch& patch) const {
    if (hits.geometry[0] == kNone || !hitOnePrimitive(hits, count))
        return false;
    const LatticeSurface& surface = surfaces.of(hits, 0);
    if (!surface.isFixed || !surface.mesh)
        return false;
    patch.instance = surface.instance, patch.geometry = surface.geometry, patch.prim = hits.prim[0];
    patch.keySum = primitiveSum(surface.keySum, patch.prim);
    return true;
}

bool SurfaceLattice::divide(const VisibilitySoA& samples, int count, const LatticeSoA& cones,
                            SurfaceCache& surfaces, LatticePatch& patch) const {
    const Edges edges = surfaces.of(samples.hit, 0).fixedEdges(patch.prim);
    return patch.divide(samples, count, edges, cones, m_blockSize, m_sharesSmall);
}

void SurfaceLattice::locate(LatticeSoA& lanes, SurfaceCache& surfaces) const {
    const bool anyBends = fetch(lanes, surfaces);
    const bool anySmall = lanes.divideTriangles(m_blockSize, m_sharesSmall);
    for (int i = 0; anyBends && i < lanes.count; ++i)
        if (lanes.bends[i])
            lanes.divideQuadric(i, lanes.seesFront[i]);
    lanes.mixKeys();
    if (anySmall)
        findGrids(lanes, surfaces);
}

/// Small triangles whose vertices are more than blocks share the places of a grid.
void SurfaceLattice::findGrids(LatticeSoA& lanes, SurfaceCache& surfaces) const {
    MeshCellSoA& grid = lanes.grid;
    int32_t small[kSoAWidth], lane[kSoAWidth];
    int count = 0;
    for (int i = 0; i < lanes.count; ++i)
        small[count] = i, count += lanes.kind[i] == LatticeCell::Vertices;
    grid.count = 0;
    for (int k = 0; k < count; ++k) {
        const int i = small[k];
        const LatticeSurface& surface = surfaces.of(lanes.hit, i);
        if (sqr(lanes.block[i]) < surface.leastBlock2) // most gain nothing, and need not be asked about
            continue;
        lane[grid.count] = i;
        surface.cells->ask(lanes.hit.prim[i], lanes.place.x[i], lanes.place.y[i], sqr(lanes.block[i]),
                           lanes.normal2[i], grid);
    }
    if (grid.count == 0)
        return;
    grid.surround();
    for (int g = 0; g < grid.count; ++g) {
        const int i = lane[g];
        if (!grid.found[g])
            continue;
        const LatticeFace face{lanes.hit.instance[i], lanes.hit.geometry[i], false};
        const MeshCell lowest = grid.lowest(g);
        const uint32_t item = uint32_t(lowest.level << 3 | lowest.direction);
        lanes.kind[i] = LatticeCell::Grid, lanes.inGrid[i] = g;
        lanes.place.set(i, grid.place.at(g));
        lanes.key[i] = mix64(quickSum<1>(faceSum(face), latticeItem(item, kGridKey, lanes.positive[i]),
                                         uint64_t(uint32_t(lowest.x)) << 32 | uint32_t(lowest.y), lowest.z));
    }
}

LatticeCell SurfaceLattice::cellAt(const LatticeSoA& lanes, int i) {
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

void SurfaceLattice::points(const LatticeCell& cell, MeshPointCache& known,
                            LatticePoint out[LatticeCell::kPoints]) const {
    const LatticeFace& face = cell.face;
    const auto inner = [&](float u, float v) { return innerPoint(face, cell.prim, u, v); };
    if (cell.kind == LatticeCell::Rectangle) {
        for (int k = 0; k < 4; ++k)
            out[k] = inner((cell.i + float(k & 1)) / cell.nu, (cell.j + float(k >> 1)) / cell.nv);
        return;
    }
    if (cell.kind == LatticeCell::Grid)
        return gridPoints(cellsOf(face), cell, known, out);
    if (cell.kind == LatticeCell::Vertices) {
        const uint32_t* index = &meshOf(face).indices[3 * size_t(cell.prim)];
        for (int k = 0; k < 3; ++k)
            out[k] = vertexPoint(face, index[k]);
        return;
    }
    LatticeSoA lanes;
    lanes.count = 1;
    lanes.hit.set(0, {face.instance, face.geometry, cell.prim, 0, 0, 0});
    lanes.kind[0] = cell.kind, lanes.positive[0] = face.positive;
    lanes.i[0] = cell.i, lanes.j[0] = cell.j, lanes.nu[0] = cell.nu, lanes.nv[0] = cell.nv;
    lanes.keySum[0] = primitiveSum(faceSum(face), cell.prim);
    TrianglePointSoA found;
    found.push(lanes, 0);
    points(lanes.hit, found, 3);
    for (int k = 0; k < 3; ++k)
        out[k] = found.points[k].at(0);
}

void SurfaceLattice::points(const HitSoA& hits, TrianglePointSoA& out, int each) const {
    out.find(each);
    for (int k = 0; k < each; ++k)
        for (int c = 0; c < out.count; ++c)
            if (out.points[k].corner[c] >= 0)
                findVertex(hits, out, out.points[k], c);
}

/// Point number c is a triangle's corner. It is the vertex if the triangles around share its normal.
void SurfaceLattice::findVertex(const HitSoA& hits, const TrianglePointSoA& cells,
                                TrianglePointSoA::Points& points, int c) const {
    const int lane = cells.lane[c];
    const LatticeFace face{hits.instance[lane], hits.geometry[lane], bool(cells.positive[c])};
    const TriangleMesh& mesh = meshOf(face);
    if (mesh.normals.empty()) {
        points.corner[c] = -1;
        return;
    }
    const LatticePoint vertex =
        vertexPoint(face, mesh.indices[3 * size_t(hits.prim[lane]) + size_t(points.corner[c])]);
    points.prim[c] = vertex.prim, points.keySum[c] = vertex.keySum;
}

void SurfaceLattice::gridPoints(const MeshCells& cells, const LatticeCell& cell, MeshPointCache& known,
                                LatticePoint out[8]) const {
    std::optional<MeshPoint> places[8];
    cells.places(cell.lowest, known, places);
    for (int k = 0; k < 8; ++k)
        out[k] =
            places[k] ? innerPoint(cell.face, places[k]->prim, places[k]->u, places[k]->v) : LatticePoint();
}

namespace {

/// Rows `at` to `at + points.count`: rays from where the camera sees the points.
STROBE_TARGET_CLONES void look(const ShadedPointSoA& points, RequestSoA& out, int at) {
    // A point beyond the silhouette is shaded as if seen at a grazing angle from the side that the sample
    // saw.
    constexpr float kGrazing = 0.02f;
    const int n = points.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f normal = normalizeAny(points.n.at(i)) * (points.positive[i] ? 1.f : -1.f);
        const V3f p = points.p.at(i), to = p - points.viewpoint.at(i);
        const float t = length(to);
        const V3f towards = normalize(-to);
        const float cosine = dot(towards, normal);
        const V3f raised = normalize(towards + normal * (kGrazing - cosine));
        const V3f wo(cosine < kGrazing ? raised.x : towards.x, cosine < kGrazing ? raised.y : towards.y,
                     cosine < kGrazing ? raised.z : towards.z);
        const int k = at + i;
        out.ray.o.x[k] = p.x + wo.x * t, out.ray.o.y[k] = p.y + wo.y * t, out.ray.o.z[k] = p.z + wo.z * t;
        out.ray.d.x[k] = -wo.x, out.ray.d.y[k] = -wo.y, out.ray.d.z[k] = -wo.z;
        out.hit.instance[k] = points.hit.instance[i], out.hit.geometry[k] = points.hit.geometry[i];
        out.hit.prim[k] = points.hit.prim[i];
        out.hit.u[k] = points.hit.u[i], out.hit.v[k] = points.hit.v[i], out.hit.t[k] = t;
        out.time[k] = points.time[i], out.width[k] = points.width[i], out.spread[k] = points.spread[i];
    }
}

} // namespace

void SurfaceLattice::request(ShadedPointSoA& points, SurfaceCache& surfaces, RequestSoA& out, int at) const {
    for (int begin = 0, end; begin < points.count; begin = end) {
        const LatticeSurface& surface = surfaces.of(points.hit, begin);
        for (end = begin + 1; end < points.count && surface.isOf(points.hit, end);)
            ++end;
        for (int i = begin; i < end; ++i)
            if (points.isVertex[i]) {
                const MeshPoint place = surface.placeOf(points.hit.prim[i]);
                points.hit.prim[i] = place.prim, points.hit.u[i] = place.u, points.hit.v[i] = place.v;
            }
        surface.spots(points.hit, points.time, begin, end, points.p, points.n);
    }
    m_scene.camera().viewpointSoA(points.p, points.lens, points.time, points.count, points.viewpoint);
    findCones(points);
    look(points, out, at);
}

/// A shade stands for a block: textures are filtered over as much, but never over less than a pixel.
void SurfaceLattice::findCones(ShadedPointSoA& points) const {
    if (!m_scene.needsFootprint()) { // then nobody asks how wide they are
        std::fill_n(points.width, points.count, 0.f), std::fill_n(points.spread, points.count, 0.f);
        return;
    }
    const Camera& camera = m_scene.camera();
    V2SoA film;
    for (int i = 0; i < points.count; ++i)
        film.set(i, camera.project(points.p.at(i), points.time[i]).value_or(FilmPoint{}).film);
    camera.coneSoA(film, points.count, points.width, points.spread);
    const float scale = std::max(m_blockSize, 1.f);
    for (int i = 0; i < points.count; ++i)
        points.width[i] *= scale, points.spread[i] *= scale;
}

} // namespace strobe
