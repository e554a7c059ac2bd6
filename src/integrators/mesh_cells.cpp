#include "integrators/mesh_cells.h"

#include "core/hash.h"

namespace strobe {

namespace {

/// Triangles with longer edges, in cells, are too large to be gone through cell by cell.
constexpr float kLongest = 2;
/// How many levels halve the size of a cell.
constexpr int kLevelsPerOctave = 2;
/// A cell counts when its centre is no farther from the surface than this, in cells.
constexpr float kNear = .5f;

/// A triangle at rest.
struct Triangle {
    V3f p, a, b; ///< a corner, and the edges to the others

    Triangle(const TriangleMesh& mesh, uint32_t prim) {
        const uint32_t* index = &mesh.indices[3 * size_t(prim)];
        const auto& positions = mesh.positions[0];
        p = positions[index[0]], a = positions[index[1]] - p, b = positions[index[2]] - p;
    }
    V3f at(float u, float v) const { return p + a * u + b * v; }
    /// As long as twice the area.
    V3f normal() const { return cross(a, b); }
    bool shorterThan(float edge) const {
        return std::max({length2(a), length2(b), length2(b - a)}) <= sqr(edge);
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
int mainDirection(const V3f& n) {
    int axis = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(n[i]) > 1.01f * std::abs(n[axis]))
            axis = i;
    return 2 * axis + (n[axis] < 0);
}

/// The largest integer not above x.
int cellIndex(float x) {
    x = std::clamp(x, -1e9f, 1e9f);
    const int towardsZero = int(x);
    return towardsZero - (float(towardsZero) > x);
}

void moveTo(MeshCell& cell, const V3f& p) {
    cell.x = cellIndex(p.x), cell.y = cellIndex(p.y), cell.z = cellIndex(p.z);
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
    for (int i = 0; i < kLevels; ++i) // in the middle of the sizes that the level serves
        m_levels[size_t(i)].cellSize = m_spacing * std::exp2((float(i) + .5f) / float(kLevelsPerOctave));
}

/// The level of the cells nearest to `size`; -1: finer than the vertices.
int MeshCells::levelFor(float size) const {
    const float level = std::floor(float(kLevelsPerOctave) * std::log2(size / m_spacing));
    return level >= 0 ? int(std::min(level, float(kLevels - 1))) : -1;
}

bool MeshCells::surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest,
                         float weights[8]) const {
    const Triangle t(m_mesh, prim);
    const V3f n = t.normal();
    const int level = levelFor(std::sqrt(cellArea * length(n) / 2));
    if (level < 0)
        return false;
    const float size = m_levels[size_t(level)].cellSize;
    if (!t.shorterThan(kLongest * size))
        return false;
    lowest.level = level;
    lowest.direction = mainDirection(n);
    const V3f p = t.at(u, v) * (1 / size) - V3f(.5f);
    moveTo(lowest, p);
    const float base[3] = {float(lowest.x), float(lowest.y), float(lowest.z)};
    float upper[3];
    for (int axis = 0; axis < 3; ++axis) // never 0 or 1, lest the only cell that counts weigh nothing
        upper[axis] = std::clamp(p[axis] - base[axis], 1e-3f, 1 - 1e-3f);
    for (int k = 0; k < 8; ++k)
        weights[k] = (k & 1 ? upper[0] : 1 - upper[0]) * (k & 2 ? upper[1] : 1 - upper[1]) *
                     (k & 4 ? upper[2] : 1 - upper[2]);
    return true;
}

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
