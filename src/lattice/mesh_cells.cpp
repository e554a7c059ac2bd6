#include "lattice/mesh_cells.h"

#include "core/math/hash.h"

#include <bit>

namespace strobe {

namespace {

/// Triangles with longer edges, in cells, do not use mesh cells: too many cells would have to search them.
constexpr float kMaxEdge = 2;
/// A cell has a point if its center is no farther from the surface than this, in cells.
constexpr float kMaxDistance = .5f;

/// A triangle at rest.
struct Triangle {
    V3f p, a, b; ///< the first vertex, and the edges from there to the others

    Triangle(const V3f& p, const V3f& a, const V3f& b) : p(p), a(a), b(b) {}
    Triangle(const TriangleMesh& mesh, uint32_t prim) {
        const uint32_t* index = &mesh.indices[3 * size_t(prim)];
        const auto& positions = mesh.positions[0];
        p = positions[index[0]];
        a = positions[index[1]] - p;
        b = positions[index[2]] - p;
    }
    V3f point(float u, float v) const { return p + a * u + b * v; }
    /// Its length is twice the area.
    V3f normal() const { return cross(a, b); }
    bool hasEdgesUpTo(float maxLength) const {
        return std::max(std::max(length2(a), length2(b)), length2(b - a)) <= sqr(maxLength);
    }
};

/// Returns the parameter, in [0,1], of the point of `edge` nearest to d; both are vectors from the start of
/// the edge.
float nearestOnEdge(const V3f& edge, const V3f& d) {
    const float along = dot(edge, d), edge2 = length2(edge);
    return along <= 0 ? 0 : along >= edge2 ? 1 : along / edge2;
}

/// Returns the barycentrics of the point of a triangle that is nearest to q.
V2f nearestPoint(const Triangle& t, const V3f& q) {
    const V3f n = t.normal(), d = q - t.p;
    const float n2 = length2(n), u = dot(cross(d, t.b), n), v = dot(cross(t.a, d), n);
    if (n2 > 0 && u >= 0 && v >= 0 && u + v <= n2)
        return {u / n2, v / n2};
    const float third = nearestOnEdge(t.b - t.a, d - t.a);
    V2f nearest(1 - third, third);
    for (const V2f& other : {V2f(nearestOnEdge(t.a, d), 0), V2f(0, nearestOnEdge(t.b, d))})
        if (length2(t.point(other.x, other.y) - q) < length2(t.point(nearest.x, nearest.y) - q))
            nearest = other;
    return nearest;
}

/// Returns MeshCell::direction. An axis must exceed the axes before it by 1 %, so that rounding does not
/// decide for normals halfway between two axes, which are common in architecture.
inline int mainDirection(const V3f& n) {
    const float x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
    const bool pastX = y > 1.01f * x;
    const bool isZ = z > 1.01f * (pastX ? y : x);
    const int xy = pastX ? 2 + (n.y < 0) : n.x < 0;
    return isZ ? 4 + (n.z < 0) : xy;
}

/// Returns the largest integer <= x, for |x| up to 1e9.
inline int floorToInt(float x) {
    x = std::clamp(x, -1e9f, 1e9f);
    const int towardsZero = int(x);
    return towardsZero - (float(towardsZero) > x);
}

/// Returns the size of the cells of a level: the geometric mean of the sizes that the level serves, from
/// spacing * 2^(level/2) to spacing * 2^((level+1)/2).
inline float cellSizeOf(int level, float spacing) {
    constexpr float kRoot4Of2 = 1.18920712f, kRoot4Of8 = 1.68179283f; // 2^(1/4), 2^(3/4)
    const float power = std::bit_cast<float>(uint32_t(127 + level / 2) << 23);
    return spacing * (power * (level & 1 ? kRoot4Of8 : kRoot4Of2));
}

/// The output of MeshCells::surround.
struct SurroundingCells {
    bool isUsable;
    MeshCell lowest;
    V3f coords;
};

/// See MeshCells::surround. Level 0 has cells of about `spacing`.
inline SurroundingCells surroundPoint(const Triangle& t, float u, float v, float cellArea, float spacing,
                                      int maxLevel) {
    const V3f n = t.normal();
    // The level is twice the binary logarithm of the size, which is the binary logarithm of the area: the
    // exponent.
    const float area = cellArea * length(n) / (2 * sqr(spacing));
    const int level = std::clamp(int(std::bit_cast<uint32_t>(area) >> 23) - 127, 0, maxLevel);
    const float size = cellSizeOf(level, spacing);
    SurroundingCells cells;
    cells.isUsable = (area >= 1) & t.hasEdgesUpTo(kMaxEdge * size);
    const V3f p = t.point(u, v) * (1 / size) - V3f(.5f);
    cells.lowest.level = level;
    cells.lowest.direction = mainDirection(n);
    cells.lowest.x = floorToInt(p.x);
    cells.lowest.y = floorToInt(p.y);
    cells.lowest.z = floorToInt(p.z);
    const auto coord = [](float x, int cell) { // not 0 or 1: the only cell with a point must have a weight
        return std::clamp(x - float(cell), 1e-3f, 1 - 1e-3f);
    };
    cells.coords = {coord(p.x, cells.lowest.x), coord(p.y, cells.lowest.y), coord(p.z, cells.lowest.z)};
    return cells;
}

/// Returns the center of a cell, in cells.
V3f centerOf(const MeshCell& cell) { return V3f(float(cell.x), float(cell.y), float(cell.z)) + V3f(.5f); }

} // namespace

MeshCells::MeshCells(const TriangleMesh& mesh, PointQuery pointQuery)
    : m_mesh(mesh), m_pointQuery(std::move(pointQuery)), m_triangle(mesh.vertexCount(), kNone) {
    const auto verticesOf = [&](uint32_t prim) { return &mesh.indices[3 * size_t(prim)]; };
    double area = 0;
    // Triangles of zero area receive no light: they represent only vertices that have no other triangle.
    std::vector<uint32_t> withoutArea;
    for (uint32_t prim = uint32_t(mesh.triangleCount()); prim-- > 0;) {
        const float doubleArea = length(Triangle(mesh, prim).normal());
        area += double(doubleArea) / 2;
        if (doubleArea > 0) {
            for (int k = 0; k < 3; ++k)
                m_triangle[verticesOf(prim)[k]] = prim;
        } else {
            withoutArea.push_back(prim);
        }
    }
    for (; !withoutArea.empty(); withoutArea.pop_back()) {
        const uint32_t prim = withoutArea.back();
        for (int k = 0; k < 3; ++k)
            if (uint32_t& triangle = m_triangle[verticesOf(prim)[k]]; triangle == kNone)
                triangle = prim;
    }
    m_spacing = std::max(float(std::sqrt(area / double(std::max<size_t>(mesh.vertexCount(), 1)))), 1e-20f);
}

bool MeshCells::surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest,
                         V3f& coords) const {
    const SurroundingCells cells =
        surroundPoint(Triangle(m_mesh, prim), u, v, cellArea, m_spacing, kLevels - 1);
    lowest = cells.lowest;
    coords = cells.coords;
    return cells.isUsable;
}

void MeshCells::appendQuery(uint32_t prim, float u, float v, float side2, float area2,
                            MeshCellSoA& queries) const {
    const int i = queries.count++;
    const Triangle t(m_mesh, prim);
    queries.p.set(i, t.p);
    queries.a.set(i, t.a);
    queries.b.set(i, t.b);
    queries.u[i] = u;
    queries.v[i] = v;
    queries.side2[i] = side2;
    queries.area2[i] = area2;
    queries.spacing[i] = m_spacing;
}

namespace {

STROBE_TARGET_CLONES void surroundSoA(MeshCellSoA& queries, int maxLevel) {
    const int n = queries.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const float cellArea = 2 * queries.side2[i] / std::sqrt(queries.area2[i]);
        const Triangle triangle(queries.p.at(i), queries.a.at(i), queries.b.at(i));
        const SurroundingCells cells =
            surroundPoint(triangle, queries.u[i], queries.v[i], cellArea, queries.spacing[i], maxLevel);
        queries.isUsable[i] = cells.isUsable;
        queries.level[i] = cells.lowest.level;
        queries.direction[i] = cells.lowest.direction;
        queries.x[i] = cells.lowest.x;
        queries.y[i] = cells.lowest.y;
        queries.z[i] = cells.lowest.z;
        queries.coords.x[i] = cells.coords.x;
        queries.coords.y[i] = cells.coords.y;
        queries.coords.z[i] = cells.coords.z;
    }
}

} // namespace

void MeshCellSoA::surround() { surroundSoA(*this, MeshCells::kLevels - 1); }

void MeshCells::findPoints(const MeshCell& lowest, MeshPointCache& cache,
                           std::optional<MeshPoint> out[8]) const {
    // The first radius suffices except at borders and tips, where farther points are used. Any point of the
    // surface lies in one of the eight cells around it, no farther from the cell's center than half a
    // diagonal; infinity allows for rounding.
    for (const float radius : {kMaxDistance, .87f, kInfinity}) {
        bool anyPoint = false;
        for (int k = 0; k < 8; ++k) {
            MeshCell cell = lowest;
            cell.x += k & 1;
            cell.y += k >> 1 & 1;
            cell.z += k >> 2;
            const uint64_t key =
                fastHashOf(reinterpret_cast<uintptr_t>(&m_mesh), cell.x, cell.y, cell.z,
                           cell.level << 3 | cell.direction, std::bit_cast<uint32_t>(radius));
            out[k] = cache.findOrCompute(key | 1, [&] { return findNearest(cell, radius); });
            anyPoint |= out[k].has_value();
        }
        if (anyPoint)
            return;
    }
}

/// Returns the point of the surface nearest to the center of the cell, if it is within `radius` cells. Of
/// equally near points, returns that of the triangle with the lowest number.
std::optional<MeshPoint> MeshCells::findNearest(const MeshCell& cell, float radius) const {
    const float size = cellSizeOf(cell.level, m_spacing), scale = 1 / size;
    const V3f center = centerOf(cell), p = center * size;
    const float rounding = 1e-6f * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    const auto queryRadius = [&](float radius2) { return std::sqrt(radius2) * size * 1.0001f + rounding; };
    std::optional<MeshPoint> nearest;
    float nearest2 = sqr(radius); // squared distance, in cells
    m_pointQuery(p, queryRadius(nearest2), [&](uint32_t prim) {
        Triangle t(m_mesh, prim);
        const V3f n = t.normal();
        if (t.hasEdgesUpTo(kMaxEdge * size) && n != V3f(0) && mainDirection(n) == cell.direction) {
            t.p *= scale;
            t.a *= scale;
            t.b *= scale;
            const V2f uv = nearestPoint(t, center);
            const float d2 = length2(t.point(uv.x, uv.y) - center);
            if (nearest && d2 == nearest2 ? prim < nearest->prim : d2 <= nearest2) {
                nearest = {prim, uv.x, uv.y};
                nearest2 = d2;
            }
        }
        return queryRadius(nearest2);
    });
    return nearest;
}

} // namespace strobe
