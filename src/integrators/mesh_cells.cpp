#include "integrators/mesh_cells.h"

#include "core/hash.h"

#include <bit>

namespace strobe {

namespace {

/// Triangles with longer edges, in cells, are too large to be gone through cell by cell.
constexpr float kLongest = 2;
/// A cell counts when its centre is no farther from the surface than this, in cells.
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
    s.found = (area >= 1) & t.shorterThan(kLongest * size);
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

V3f centreOf(const MeshCell& cell) { return V3f(float(cell.x), float(cell.y), float(cell.z)) + V3f(.5f); }

uint64_t keyOf(const MeshCell& cell) {
    const uint64_t key = hashCombine(uint64_t(uint32_t(cell.x)) << 32 | uint32_t(cell.y),
                                     uint64_t(uint32_t(cell.z)) << 3 | uint32_t(cell.direction));
    return key ? key : 1;
}

} // namespace

MeshCells::MeshCells(const TriangleMesh& mesh) : m_mesh(mesh), m_triangle(mesh.vertexCount(), 0) {
    double area = 0;
    for (uint32_t prim = uint32_t(mesh.triangleCount()); prim-- > 0;) {
        for (int k = 0; k < 3; ++k)
            m_triangle[mesh.indices[3 * size_t(prim) + size_t(k)]] = prim;
        area += double(length(Triangle(mesh, prim).normal())) / 2;
    }
    m_spacing = std::max(float(std::sqrt(area / double(std::max<size_t>(mesh.vertexCount(), 1)))), 1e-20f);
    for (int i = 0; i < kLevels; ++i)
        m_levels[size_t(i)].cellSize = cellSizeOf(i, m_spacing);
}

bool MeshCells::surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest,
                         V3f& place) const {
    const Surrounding s = surrounding(Triangle(m_mesh, prim), u, v, cellArea, m_spacing, kLevels - 1);
    lowest = s.lowest, place = s.place;
    return s.found;
}

void MeshCells::ask(uint32_t prim, float u, float v, float cellArea, MeshCellLanes& lanes) const {
    const int i = lanes.count++;
    const Triangle t(m_mesh, prim);
    lanes.p.set(i, t.p), lanes.a.set(i, t.a), lanes.b.set(i, t.b);
    lanes.u[i] = u, lanes.v[i] = v, lanes.cellArea[i] = cellArea, lanes.spacing[i] = m_spacing;
}

namespace {

STROBE_LANES void surroundLanes(MeshCellLanes& l, int most) {
    const int n = l.count;
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        const Surrounding s =
            surrounding({l.p.at(i), l.a.at(i), l.b.at(i)}, l.u[i], l.v[i], l.cellArea[i], l.spacing[i], most);
        l.found[i] = s.found;
        l.level[i] = s.lowest.level, l.direction[i] = s.lowest.direction;
        l.x[i] = s.lowest.x, l.y[i] = s.lowest.y, l.z[i] = s.lowest.z;
        l.place.x[i] = s.place.x, l.place.y[i] = s.place.y, l.place.z[i] = s.place.z;
    }
}

} // namespace

void MeshCellLanes::surround() { surroundLanes(*this, MeshCells::kLevels - 1); }

void MeshCells::places(const MeshCell& lowest, std::optional<MeshPlace> out[8]) const {
    const float scale = 1 / m_levels[size_t(lowest.level)].cellSize;
    bool isNear[8], anyNear = false;
    for (int k = 0; k < 8; ++k) {
        MeshCell cell = lowest;
        cell.x += k & 1, cell.y += k >> 1 & 1, cell.z += k >> 2;
        const Entry* entry = find(cell);
        out[k] = entry ? std::optional(entry->place()) : std::nullopt;
        isNear[k] = entry && distance2(entry->place(), scale, centreOf(cell)) <= sqr(kNear);
        anyNear |= isNear[k];
    }
    if (anyNear) // as is always so but at rims and tips: there, what the surface only passes through stands
                 // in
        for (int k = 0; k < 8; ++k)
            if (!isNear[k])
                out[k].reset();
}

/// Of a place from a cell's centre, in cells, squared.
float MeshCells::distance2(const MeshPlace& place, float scale, const V3f& centre) const {
    return length2(Triangle(m_mesh, place.prim).at(place.u, place.v) * scale - centre);
}

const MeshCells::Entry* MeshCells::find(const MeshCell& cell) const {
    Level& level = m_levels[size_t(cell.level)];
    std::call_once(level.once, [&] { make(level); });
    const uint64_t key = keyOf(cell);
    const Part& part = level.partOf(key);
    const Entry* entry = part.entries.empty() ? nullptr : &part.entries[part.slot(key)];
    return entry && entry->key ? entry : nullptr;
}

/// The key's slot, or the free one where it belongs.
size_t MeshCells::Part::slot(uint64_t key) const {
    const uint64_t inPart = key << kPartBits; // the upper bits chose the part
    size_t i = size_t((unsigned __int128)(inPart)*entries.size() >> 64);
    while (entries[i].key && entries[i].key != key)
        i = i + 1 < entries.size() ? i + 1 : 0;
    return i;
}

/// The key's entry, filed if it was not: then its key is 0 and to be filled in.
MeshCells::Entry& MeshCells::Part::add(uint64_t key) {
    if (5 * (count + 1) > 4 * entries.size()) {
        std::vector<Entry> old(entries.size() + entries.size() / 4 + 8);
        old.swap(entries);
        for (const Entry& e : old)
            if (e.key)
                entries[slot(e.key)] = e;
    }
    Entry& entry = entries[slot(key)];
    count += !entry.key;
    return entry;
}

void MeshCells::make(Level& level) const {
    for (uint32_t prim = 0; prim < m_mesh.triangleCount(); ++prim)
        addTriangle(level, prim);
}

/// Of a triangle's points nearest to the centres of the cells around it, each is offered to the cell in which
/// it lies. Of the eight cells around a point of the triangle, at least one is so given a place: the
/// triangle's nearest point to the centre of the cell that holds the given point lies in a ball between the
/// two (nearest points of convex sets), which is too small to reach beyond the eight.
void MeshCells::addTriangle(Level& level, uint32_t prim) const {
    Triangle t(m_mesh, prim);
    if (!t.shorterThan(kLongest * level.cellSize))
        return;
    const int direction = mainDirection(t.normal()); // as `surround` sees it, before any rounding
    const float scale = 1 / level.cellSize;
    t.p *= scale, t.a *= scale, t.b *= scale;
    Box3f box(t.p);
    box.extendBy(t.p + t.a);
    box.extendBy(t.p + t.b);
    MeshCell first{}, last{};
    moveTo(first, box.min);
    moveTo(last, box.max);
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) {
                MeshCell cell{0, x, y, z, direction};
                const V2f uv = nearestPoint(t, centreOf(cell));
                const V3f p = t.at(uv.x, uv.y);
                moveTo(cell, p);
                const uint64_t key = keyOf(cell);
                Entry& held = level.partOf(key).add(key);
                const V3f centre = centreOf(cell);
                if (!held.key || length2(p - centre) < distance2(held.place(), scale, centre))
                    held = Entry(key, {prim, uv.x, uv.y});
            }
}

size_t MeshCells::bytes() const {
    size_t sum = m_triangle.capacity() * sizeof(uint32_t);
    for (const Level& level : m_levels)
        for (const Part& part : level.parts)
            sum += part.entries.capacity() * sizeof(Entry);
    return sum;
}

} // namespace strobe
