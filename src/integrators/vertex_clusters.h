// A hierarchy of a mesh's vertices: fewer and fewer of them stand for all.
#pragma once

#include "core/shape.h"

#include <vector>

namespace strobe {

/// Level l groups the vertices by cubic cells of size cellSize(l) (object space, doubling from level to
/// level) and by the main direction of their normals; one vertex of each group represents it. Deforming
/// meshes are grouped as they are at their first key.
class VertexClusters {
  public:
    explicit VertexClusters(const TriangleMesh& mesh);

    /// The level whose cells are nearest to `size`, to a factor of the root of two; -1: the vertices
    /// themselves.
    int levelFor(float size) const;
    float cellSize(int level) const { return m_finest * float(1 << level); }
    /// The vertex that stands for `vertex` at `level` (itself at level -1).
    uint32_t representative(uint32_t vertex, int level) const;
    /// A triangle that has the vertex (always the same one).
    uint32_t triangleOf(uint32_t vertex) const { return m_triangle[vertex]; }

  private:
    struct Level {
        std::vector<uint32_t> parent; ///< of a group (or vertex) of the level below: the group at this level
        std::vector<uint32_t> vertexOf; ///< of a group: the vertex that represents it
    };
    float m_finest = 1;
    std::vector<Level> m_levels;
    std::vector<uint32_t> m_triangle;
};

} // namespace strobe
