#include "lattice/mesh_cells.h"

#include "core/math/hash.h"

#include <bit>

namespace strobe {

namespace {

/// Triangles with longer edges, in cells, are too large to be gone through cell by cell.
constexpr float kMaxEdge = 2;
/// A cell counts when its center is no farther from the surface than this, in cells.
constexpr float kNear = .5f;

/// A triangle at rest.
struct Triangle {
    V3f p, a, b; ///< a corner, and the edges to the others

    Triangle(const V3f& p, const V3f& a, const V3f& b) : p(p), a(a), b(b) {}
    Triangle(const TriangleMesh& mesh, uint32_t prim) {
        const uint32_t* index = &mesh.indices[3 * size_t(prim)];
        const auto& positions = mesh.positions[0];
        p = positions[index[0]], a = positions[index[1]] - p, b = positions[index[2]] - p;
    }
    V3f at(float u, float v) const { return p + a * u + b * v; }
    /// As long as twice the area.
    V3f normal() const { return cross(a, b); }
    bool shorterThan(float edge) const {
        return std::max(std::max(length2(a), length2(b)), length2(b - a)) <= sqr(edge);
    }
};

/// Where the point of an edge lies that is nearest to d, in [0,1]; both start at the same place.
float nearestOnEdge(const V3f& edge, const V3f& d) {
    const float along = dot(edge, d), whole = length2(edge);
    return along <= 0 ? 0 : along >= whole ? 1 : along / whole;
}

/// The barycentrics of the point of a triangle that is nearest to q.
V2f nearestPoint(const Triangle& t, const V3f& q) {
    const V3f n = t.normal(), d = q - t.p;
    const float n2 = length2(n), u = dot(cross(d, t.b), n), v = dot(cross(t.a, d), n);
    if (n2 > 0 && u >= 0 && v >= 0 && u + v <= n2)
        return {u / n2, v / n2};
    const float third = nearestOnEdge(t.b - t.a, d - t.a);
    V2f nearest(1 - third, third);
    for (const V2f& other : {V2f(nearestOnEdge(t.a, d), 0), V2f(0, nearestOnEdge(t.b, d))})
        if (length2(t.at(other.x, other.y) - q) < length2(t.at(nearest.x, nearest.y) - q))
            nearest = other;
    return nearest;
}

/// Halfway between two axes, where walls may stand, rounding does not choose: the first axis wins by a
/// little.
inline int mainDirection(const V3f& n) {
    const float x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
    const bool pastX = y > 1.01f * x;
    const bool isZ = z > 1.01f * (pastX ? y : x);
    const int xy = pastX ? 2 + (n.y < 0) : n.x < 0;
    return isZ ? 4 + (n.z < 0) : xy;
}

/// The largest integer not above x.
inline int cellIndex(float x) {
    x = std::clamp(x, -1e9f, 1e9f);
    const int towardsZero = int(x);
    return towardsZero - (float(towardsZero) > x);
}

inline void moveTo(MeshCell& cell, const V3f& p) {
    cell.x = cellIndex(p.x), cell.y = cellIndex(p.y), cell.z = cellIndex(p.z);
}

/// The size of a level's cells: two levels double it. It is in the middle of the sizes that the level serves.
inline float cellSizeOf(int level, float spacing) {
    constexpr float kFourthRoot = 1.18920712f, kItsCube = 1.68179283f; // of 2
    const float power = std::bit_cast<float>(uint32_t(127 + level / 2) << 23);
    return spacing * (power * (level & 1 ? kItsCube : kFourthRoot));
}

/// What surrounds a point of a triangle. See MeshCells::surround.
struct Surrounding {
    bool found;
    MeshCell lowest;
    V3f place;
};

/// Levels are counted from the size of `spacing`; the highest is `most`.
inline Surrounding surrounding(const Triangle& t, float u, float v, float cellArea, float spacing, int most) {
    const V3f n = t.normal();
    // Half the area's binary logarithm is the size's, and two levels double the size: the exponent will do.
    const float area = cellArea * length(n) / (2 * sqr(spacing));
    const int level = std::clamp(int(std::bit_cast<uint32_t>(area) >> 23) - 127, 0, most);
    const float size = cellSizeOf(level, spacing);
    Surrounding s;
    s.found = (area >= 1) & t.shorterThan(kMaxEdge * size);
    s.lowest.level = level;
    s.lowest.direction = mainDirection(n);
    const V3f p = t.at(u, v) * (1 / size) - V3f(.5f);
    moveTo(s.lowest, p);
    const auto inside = [](float x, int cell) { // never 0 or 1, lest the only cell that counts weigh nothing
        return std::clamp(x - float(cell), 1e-3f, 1 - 1e-3f);
    };
    s.place = {inside(p.x, s.lowest.x), inside(p.y, s.lowest.y), inside(p.z, s.lowest.z)};
    return s;
}

V3f centerOf(const MeshCell& cell) { return V3f(float(cell.x), float(cell.y), float(cell.z)) + V3f(.5f); }

} // namespace

MeshCells::MeshCells(const TriangleMesh& mesh, PointQuery pointQuery)
    : m_mesh(mesh), m_pointQuery(std::move(pointQuery)), m_triangle(mesh.vertexCount(), kNone) {
    const auto verticesOf = [&](uint32_t prim) { return &mesh.indices[3 * size_t(prim)]; };
    double area = 0;
    std::vector<uint32_t> flat; // without area: they see no light, and stand for vertices of no others only
    for (uint32_t prim = uint32_t(mesh.triangleCount()); prim-- > 0;) {
        const float twice = length(Triangle(mesh, prim).normal());
        area += double(twice) / 2;
        if (twice > 0)
            for (int k = 0; k < 3; ++k)
                m_triangle[verticesOf(prim)[k]] = prim;
        else
            flat.push_back(prim);
    }
    for (; !flat.empty(); flat.pop_back())
        for (int k = 0; k < 3; ++k)
            if (uint32_t& triangle = m_triangle[verticesOf(flat.back())[k]]; triangle == kNone)
                triangle = flat.back();
    m_spacing = std::max(float(std::sqrt(area / double(std::max<size_t>(mesh.vertexCount(), 1)))), 1e-20f);
}

bool MeshCells::surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest,
                         V3f& place) const {
    const Surrounding s = surrounding(Triangle(m_mesh, prim), u, v, cellArea, m_spacing, kLevels - 1);
    lowest = s.lowest, place = s.place;
    return s.found;
}

void MeshCells::ask(uint32_t prim, float u, float v, float side2, float area2, MeshCellSoA& lanes) const {
    const int i = lanes.count++;
    const Triangle t(m_mesh, prim);
    lanes.p.set(i, t.p), lanes.a.set(i, t.a), lanes.b.set(i, t.b);
    lanes.u[i] = u, lanes.v[i] = v, lanes.side2[i] = side2, lanes.area2[i] = area2,
    lanes.spacing[i] = m_spacing;
}

namespace {

STROBE_TARGET_CLONES void surroundSoA(MeshCellSoA& l, int most) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const float cellArea = 2 * l.side2[i] / std::sqrt(l.area2[i]);
        const Surrounding s =
            surrounding({l.p.at(i), l.a.at(i), l.b.at(i)}, l.u[i], l.v[i], cellArea, l.spacing[i], most);
        l.found[i] = s.found;
        l.level[i] = s.lowest.level, l.direction[i] = s.lowest.direction;
        l.x[i] = s.lowest.x, l.y[i] = s.lowest.y, l.z[i] = s.lowest.z;
        l.place.x[i] = s.place.x, l.place.y[i] = s.place.y, l.place.z[i] = s.place.z;
    }
}

} // namespace

void MeshCellSoA::surround() { surroundSoA(*this, MeshCells::kLevels - 1); }

void MeshCells::places(const MeshCell& lowest, MeshPointCache& known, std::optional<MeshPoint> out[8]) const {
    // Enough but at rims and tips: there, what is farther away stands in. Any place lies in one of the eight
    // cells around it, no farther from its center than half a diagonal; but for rounding.
    for (const float radius : {kNear, .87f, kInfinity}) {
        bool any = false;
        for (int k = 0; k < 8; ++k) {
            MeshCell cell = lowest;
            cell.x += k & 1, cell.y += k >> 1 & 1, cell.z += k >> 2;
            const uint64_t key =
                quickHashOf(reinterpret_cast<uintptr_t>(&m_mesh), cell.x, cell.y, cell.z,
                            cell.level << 3 | cell.direction, std::bit_cast<uint32_t>(radius));
            out[k] = known.of(key | 1, [&] { return nearest(cell, radius); });
            any |= out[k].has_value();
        }
        if (any)
            return;
    }
}

/// The place nearest to the cell's center, if it is no farther than `radius` cells; of several the first
/// triangle's.
std::optional<MeshPoint> MeshCells::nearest(const MeshCell& cell, float radius) const {
    const float size = cellSizeOf(cell.level, m_spacing), scale = 1 / size;
    const V3f center = centerOf(cell), p = center * size;
    const float rounding = 1e-6f * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    const auto within = [&](float radius2) { return std::sqrt(radius2) * size * 1.0001f + rounding; };
    std::optional<MeshPoint> best;
    float best2 = sqr(radius);
    m_pointQuery(p, within(best2), [&](uint32_t prim) {
        Triangle t(m_mesh, prim);
        const V3f n = t.normal();
        if (t.shorterThan(kMaxEdge * size) && n != V3f(0) && mainDirection(n) == cell.direction) {
            t.p *= scale, t.a *= scale, t.b *= scale;
            const V2f uv = nearestPoint(t, center);
            const float d2 = length2(t.at(uv.x, uv.y) - center);
            if (best && d2 == best2 ? prim < best->prim : d2 <= best2)
                best = {prim, uv.x, uv.y}, best2 = d2;
        }
        return within(best2);
    });
    return best;
}

} // namespace strobe
