// The neighbors of the cells of a CellPyramid.
#include "sharing/cell_pyramid.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr int kBlock = 4; ///< edge of the blocks of CellPyramid::Neighbors

/// The cells of a block that are near others, by the coordinates of these along each axis, relative to the
/// block.
class NearCells {
  public:
    /// `reach`: the largest distance.
    constexpr explicit NearCells(int reach) : m_reach(reach) {
        for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= kBlock)
            for (int other = 0; other < kCount; ++other)
                for (int cell = 0; cell < kBlock; ++cell)
                    if (std::max(other - reach - cell, cell - other + reach) <= reach)
                        m_bits[axis][other] |= uint64_t(1) << (cell * stride);
    }
    /// Returns bit x + 4 y + 16 z for each near cell.
    uint64_t of(int x, int y, int z) const {
        if (!isNear(x) || !isNear(y) || !isNear(z))
            return 0;
        return m_bits[0][x + m_reach] * m_bits[1][y + m_reach] * m_bits[2][z + m_reach];
    }

  private:
    static constexpr int kCount = 2 * kBlock; ///< coordinates of cells that are near some cell
    bool isNear(int coordinate) const { return coordinate >= -m_reach && coordinate < kCount - m_reach; }
    int m_reach;
    uint64_t m_bits[3][kCount] = {};
};

} // namespace

std::span<const uint32_t> CellPyramid::Neighbors::of(uint32_t node) {
    const CellId& id = m_pyramid.m_cubes[m_pyramid.m_nodes[node].cube].id;
    const CellId block = id.parent().parent();
    static_assert(kBlock == 1 << kGenerations);
    if (block != m_block || m_visited.none()) {
        m_block = block;
        m_visited.reset();
        m_candidates.clear();
    }
    const int x = id.x - kBlock * block.x, y = id.y - kBlock * block.y, z = id.z - kBlock * block.z;
    visitCubesAround(x, y, z);
    m_found.resize(std::max(m_found.size(), m_candidates.size()));
    const int bit = x + kBlock * (y + kBlock * z);
    size_t count = 0;
    for (const Candidate& candidate : m_candidates) {
        m_found[count] = candidate.node;
        count += candidate.cells >> bit & 1;
    }
    return {m_found.data(), count};
}

/// Adds the nodes of the cubes, each as large as the block, that are near a cell of the block: of up to two
/// cubes along each axis.
void CellPyramid::Neighbors::visitCubesAround(int x, int y, int z) {
    const auto first = [](int cell) { return cell < kReach ? -1 : 0; };
    for (int dx = first(x); dx <= first(x) + 1; ++dx)
        for (int dy = first(y); dy <= first(y) + 1; ++dy)
            for (int dz = first(z); dz <= first(z) + 1; ++dz) {
                const size_t number = size_t(dx + 1 + 3 * (dy + 1) + 9 * (dz + 1));
                if (m_visited[number])
                    continue;
                m_visited.set(number);
                CellId id = m_block;
                id.x += dx;
                id.y += dy;
                id.z += dz;
                if (const uint32_t cube = m_pyramid.m_blocks.find(id.hash()); cube != kAbsent)
                    addDescendants(m_pyramid.m_cubes[cube]);
            }
}

/// Adds the nodes near any cell of the block in a cube as large as the block.
void CellPyramid::Neighbors::addDescendants(const Cube& cube) {
    static_assert(kReach == kBlock / 2, "children contain near cells only, or none");
    static constexpr NearCells kNear(kReach);
    const auto isNear = [](int32_t child, int32_t block) {
        return child - 2 * block >= -1 && child - 2 * block <= 2;
    };
    for (const uint32_t childIndex : cube.children) {
        if (childIndex == kAbsent)
            continue;
        const Cube& child = m_pyramid.m_cubes[childIndex];
        if (!isNear(child.id.x, m_block.x) || !isNear(child.id.y, m_block.y) ||
            !isNear(child.id.z, m_block.z))
            continue;
        for (const uint32_t leafIndex : child.children) {
            if (leafIndex == kAbsent)
                continue;
            const Cube& leaf = m_pyramid.m_cubes[leafIndex];
            const uint64_t cells = kNear.of(leaf.id.x - kBlock * m_block.x, leaf.id.y - kBlock * m_block.y,
                                            leaf.id.z - kBlock * m_block.z);
            for (const uint32_t node : leaf.nodes)
                if (node != kAbsent && cells != 0)
                    m_candidates.push_back({cells, node});
        }
    }
}

} // namespace strobe
