// Mesh cells: a few points that represent the surface of a mesh of many triangles.
#pragma once

#include "core/scene/tracer.h"

#include <optional>
#include <vector>

namespace strobe {

/// A cubic cell of a mesh's rest space (object space at the first key), for triangles of one main direction.
struct MeshCell {
    int level; ///< of size
    int x, y, z;
    int direction; ///< 0 to 5: +x, -x, +y, -y, +z, -z, the axis closest to the triangles' normals
};

/// A point on a mesh.
struct MeshPoint {
    uint32_t prim;
    float u, v; ///< barycentrics of the second and third vertex
};

/// Up to kSoAWidth points of triangles at rest, and the eight mesh cells whose centers surround each.
struct MeshCellSoA {
    // Input, from MeshCells::appendQuery:
    int count = 0;
    V3SoA p, a, b; ///< the first vertex of the triangle, and the edges from there to the others
    alignas(64) float u[kSoAWidth], v[kSoAWidth];
    alignas(64) float side2[kSoAWidth];   ///< squared side length of the requested cells, in any space
    alignas(64) float area2[kSoAWidth];   ///< squared double area of the triangle, in the same space
    alignas(64) float spacing[kSoAWidth]; ///< of the vertices of the mesh

    // Output of `surround`: see MeshCells::surround.
    alignas(64) int32_t isUsable[kSoAWidth];
    alignas(64) int32_t level[kSoAWidth], x[kSoAWidth], y[kSoAWidth], z[kSoAWidth], direction[kSoAWidth];
    V3SoA coords;

    MeshCell lowest(int i) const { return {level[i], x[i], y[i], z[i], direction[i]}; }
    void surround();
};

/// A cache of the points of mesh cells, for one thread.
class MeshPointCache {
  public:
    /// Returns the point that is stored under `key`, which is a hash and not 0. If there is none, calls
    /// `find` and stores its result, which may be nullopt.
    template <class Find>
    std::optional<MeshPoint> findOrCompute(uint64_t key, const Find& find) {
        if (m_entries.empty())
            m_entries.resize(size_t(1) << kBits);
        Entry& entry = m_entries[key >> (64 - kBits)];
        if (entry.key != key)
            entry = {key, find().value_or(MeshPoint{kNone, 0, 0})};
        return entry.point.prim == kNone ? std::nullopt : std::optional(entry.point);
    }

  private:
    static constexpr int kBits = 15; ///< .75 MB; with fewer entries, points are computed many times
    struct Entry {
        uint64_t key = 0;
        MeshPoint point{}; ///< prim kNone: none
    };
    std::vector<Entry> m_entries; ///< empty until the first call
};

/// Grids of cubic cells at many sizes (levels) around a mesh at rest. A cell is represented by the point of
/// the surface nearest to its center. Interpolation by position between such points is nearly that of a
/// regular grid, whatever the triangulation. A cell has a point only if the surface is within half a cell of
/// its center: a plane of any orientation then has one point per area of a cell's side. Triangles of
/// different main directions use different cells, so that the two sides of a thin object do not mix.
///
/// Nothing is precomputed: points are found on demand.
class MeshCells {
  public:
    static constexpr int kLevels = 48;
    /// Tracer::pointQuery for the mesh.
    using PointQuery =
        std::function<void(const V3f& p, float radius, const Tracer::PointQueryVisitor& visitor)>;
    /// The mesh must outlive its cells.
    MeshCells(const TriangleMesh& mesh, PointQuery pointQuery);

    /// Finds the eight cells whose centers surround the point (u, v) of a triangle. The area of a cell's side
    /// is about `cellArea` times the area of the triangle, in rest space. Writes the lowest cell, and the
    /// coordinates of the point between the centers of the lowest and the highest cell, in (0,1): the
    /// trilinear weights are all positive (bit k of a weight's index is set for the upper cell along axis k).
    /// Returns false if the vertices are to be used instead: if the triangle is too large for such cells, or
    /// the mesh has fewer vertices than cells.
    bool surround(uint32_t prim, float u, float v, float cellArea, MeshCell& lowest, V3f& coords) const;
    /// Appends a query, the input of `surround` with cellArea = 2 * side2 / sqrt(area2).
    void appendQuery(uint32_t prim, float u, float v, float side2, float area2, MeshCellSoA& queries) const;
    /// Writes the points of the eight cells from the lowest one, which `surround` found; nullopt for cells
    /// without one. At least one cell has a point.
    void findPoints(const MeshCell& lowest, MeshPointCache& cache, std::optional<MeshPoint> out[8]) const;
    /// The area of the mesh per vertex. Cells whose sides have a smaller area are not usable.
    float vertexArea() const { return sqr(m_spacing); }
    /// Returns a triangle of the vertex, the same in all calls. Its area is zero only if the vertex has no
    /// other triangles.
    uint32_t triangleOf(uint32_t vertex) const { return m_triangle[vertex]; }

  private:
    std::optional<MeshPoint> findNearest(const MeshCell& cell, float radius) const;

    const TriangleMesh& m_mesh;
    const PointQuery m_pointQuery;
    float m_spacing;                  ///< of the vertices: the square root of the area per vertex
    std::vector<uint32_t> m_triangle; ///< by vertex
};

} // namespace strobe
