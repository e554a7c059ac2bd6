// Few places that stand for the surface of a mesh of many triangles.
#pragma once

#include "core/lanes.h"
#include "core/shape.h"

#include <array>
#include <mutex>
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
struct MeshPlace {
    uint32_t prim;
    float u, v;
};

/// Points of triangles at rest, side by side, and the cells whose centres surround them.
struct MeshCellLanes {
    int count = 0;
    V3Lanes p, a, b; ///< a triangle's corner, and the edges from there to the others
    alignas(64) float u[kLanes], v[kLanes];
    alignas(64) float cellArea[kLanes]; ///< see MeshCells::surround
    alignas(64) float spacing[kLanes];  ///< of the mesh's vertices
    alignas(64) int32_t found[kLanes];  ///< 0: nothing gained
    alignas(64) int32_t level[kLanes], x[kLanes], y[kLanes], z[kLanes], direction[kLanes]; ///< the lowest
    V3Lanes place; ///< between the lowest centre and the highest, in (0,1)

    MeshCell lowest(int i) const { return {level[i], x[i], y[i], z[i], direction[i]}; }
    /// Fills what is found.
    void surround();
};

/// Grids of cells at many sizes (levels). What stands for a cell is the surface's nearest point to its
/// centre, so that between cells, interpolation by position is nearly that of a regular grid, however the
/// mesh is triangulated. A cell counts when its centre is no farther from the surface than half a cell: of a
/// plane of any orientation, that makes one place per cell's area. Triangles that look different ways are
/// kept apart: the two sides of a thin thing do not mix.
///
/// A level is made when it is first asked for, by whichever thread asks; what it holds depends on the mesh
/// alone.
class MeshCells {
  public:
    static constexpr int kLevels = 48;
    /// The mesh outlives its cells.
    explicit MeshCells(const TriangleMesh& mesh);

    /// Finds the eight cells whose centres surround (u, v) of a triangle, from cells with about `cellArea`
    /// times the triangle's area (that of a cell's side, in rest space). Sets the lowest cell, and the place
    /// between its centre and that of the highest: trilinear weights (Bit k of a weight's index is 1 for the
    /// upper cell along axis k) are then all positive. False: nothing gained, for the triangle is too large
    /// for such cells, or they would be more than the mesh has vertices.
    bool surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest, V3f& place) const;
    /// Appends the same question to others.
    void ask(uint32_t prim, float u, float v, float cellArea, MeshCellLanes& lanes) const;
    /// The places of the eight cells from the lowest one that `surround` found; null for those that do not
    /// count. At least one is not null.
    void places(const MeshCell& lowest, std::optional<MeshPlace> out[8]) const;
    /// A triangle that has the vertex (always the same one).
    uint32_t triangleOf(uint32_t vertex) const { return m_triangle[vertex]; }
    /// Of what is made so far.
    size_t bytes() const;

  private:
    struct Entry {
        uint64_t key = 0; ///< 0: free
        uint32_t prim = 0;
        uint16_t u = 0, v = 0; ///< in 1/65535

        Entry() = default;
        Entry(uint64_t key, const MeshPlace& place)
            : key(key), prim(place.prim), u(uint16_t(place.u * 65535 + .5f)),
              v(std::min(uint16_t(place.v * 65535 + .5f), uint16_t(65535 - u))) {}
        MeshPlace place() const { return {prim, float(u) * (1.f / 65535), float(v) * (1.f / 65535)}; }
    };
    /// A hash table in parts that grow one by one: growing takes little more than what is kept.
    struct Part {
        std::vector<Entry> entries; ///< at most 4/5 of them used
        size_t count = 0;
        size_t slot(uint64_t key) const;
        Entry& add(uint64_t key);
    };
    static constexpr int kPartBits = 6;
    struct Level {
        float cellSize = 0;
        std::once_flag once;
        std::array<Part, size_t(1) << kPartBits> parts;
        Part& partOf(uint64_t key) { return parts[key >> (64 - kPartBits)]; }
    };

    const Entry* find(const MeshCell& cell) const;
    float distance2(const MeshPlace& place, float scale, const V3f& centre) const;
    void make(Level& level) const;
    void addTriangle(Level& level, uint32_t prim) const;

    const TriangleMesh& m_mesh;
    float m_spacing; ///< of the vertices: each has the square of it
    std::vector<uint32_t> m_triangle;
    mutable std::array<Level, kLevels> m_levels;
};

} // namespace strobe
