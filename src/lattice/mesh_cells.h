// Few places that stand for the surface of a mesh of many triangles.
#pragma once

#include "core/scene/tracer.h"

#include <optional>
#include <vector>

namespace strobe {

/// A cubic cell of a mesh's rest space (object space, the first key), and the way its triangles look.
struct MeshCell {
    int level;
    int x, y, z;
    int direction; ///< 0 … 5: the axis that the triangles' normals follow most, and which way along it
};

/// A place on a mesh, by the barycentrics of a triangle.
struct MeshPoint {
    uint32_t prim;
    float u, v;
};

/// Points of triangles at rest, side by side, and the cells whose centers surround them.
struct MeshCellSoA {
    int count = 0;
    V3SoA p, a, b; ///< a triangle's corner, and the edges from there to the others
    alignas(64) float u[kSoAWidth], v[kSoAWidth];
    /// Squared, of cells and of the triangle as these are measured: the side, twice the area.
    alignas(64) float side2[kSoAWidth], area2[kSoAWidth];
    alignas(64) float spacing[kSoAWidth]; ///< of the mesh's vertices
    alignas(64) int32_t found[kSoAWidth]; ///< 0: nothing gained
    alignas(64) int32_t level[kSoAWidth], x[kSoAWidth], y[kSoAWidth], z[kSoAWidth],
        direction[kSoAWidth]; ///< the lowest
    V3SoA place;              ///< between the lowest center and the highest, in (0,1)

    MeshCell lowest(int i) const { return {level[i], x[i], y[i], z[i], direction[i]}; }
    /// Fills what is found.
    void surround();
};

/// The places of cells that a thread asked for lately.
class MeshPointCache {
  public:
    /// What is kept under the key, which is not 0 and well mixed, or else what `find` says.
    template <class Find>
    std::optional<MeshPoint> of(uint64_t key, const Find& find) {
        if (m_entries.empty())
            m_entries.resize(size_t(1) << kBits);
        Entry& entry = m_entries[key >> (64 - kBits)];
        if (entry.key != key)
            entry = {key, find().value_or(MeshPoint{kNone, 0, 0})};
        return entry.place.prim == kNone ? std::nullopt : std::optional(entry.place);
    }

  private:
    static constexpr int kBits = 15; ///< of places in .75 MB; fewer are looked for again and again
    struct Entry {
        uint64_t key = 0;
        MeshPoint place{};
    };
    std::vector<Entry> m_entries; ///< none before the first question
};

/// Grids of cells at many sizes (levels). What stands for a cell is the surface's nearest point to its
/// center, so that between cells, interpolation by position is nearly that of a regular grid, however the
/// mesh is triangulated. A cell counts when its center is no farther from the surface than half a cell: of a
/// plane of any orientation, that makes one place per cell's area. Triangles that look different ways are
/// kept apart: the two sides of a thin thing do not mix.
///
/// Nothing is made ahead: a place is looked for when it is asked for.
class MeshCells {
  public:
    static constexpr int kLevels = 48;
    /// Tracer::pointQuery, for one mesh.
    using PointQuery = std::function<void(const V3f& p, float radius, const Tracer::PointQueryVisitor& look)>;
    /// The mesh outlives its cells.
    MeshCells(const TriangleMesh& mesh, PointQuery pointQuery);

    /// Finds the eight cells whose centers surround (u, v) of a triangle, from cells with about `cellArea`
    /// times the triangle's area (that of a cell's side, in rest space). Sets the lowest cell, and the place
    /// between its center and that of the highest: trilinear weights (Bit k of a weight's index is 1 for the
    /// upper cell along axis k) are then all positive. False: nothing gained, for the triangle is too large
    /// for such cells, or they would be more than the mesh has vertices.
    bool surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest, V3f& place) const;
    /// Appends the same question to others: `cellArea` is twice side2 over the root of area2.
    void ask(uint32_t prim, float u, float v, float side2, float area2, MeshCellSoA& lanes) const;
    /// The places of the eight cells from the lowest one that `surround` found; null for those that do not
    /// count. At least one is not null.
    void places(const MeshCell& lowest, MeshPointCache& known, std::optional<MeshPoint> out[8]) const;
    /// Of the mesh, for each of its vertices. Cells of less do not gain anything.
    float vertexArea() const { return sqr(m_spacing); }
    /// A triangle that has the vertex (always the same one), with an area if there is one.
    uint32_t triangleOf(uint32_t vertex) const { return m_triangle[vertex]; }

  private:
    std::optional<MeshPoint> nearest(const MeshCell& cell, float radius) const;

    const TriangleMesh& m_mesh;
    const PointQuery m_pointQuery;
    float m_spacing; ///< of the vertices: each has the square of it
    std::vector<uint32_t> m_triangle;
};

} // namespace strobe
