// Cells of several sizes, and their neighbors.
#pragma once

#include "core/util/index_table.h"
#include "core/util/memory.h"
#include "sharing/records/joined_cells.h"

#include <span>

namespace strobe {

/// RGB by half by part.
inline constexpr int kLightChannels = 3 * kHalves * kParts;
/// Returns the first of the three channels of a part and a half.
inline int channelOf(int part, int half) { return 3 * (kHalves * part + half); }

/// A cell of any size with the mean position, the mean normal and the mean light of all its samples.
struct CellNode {
    V3f p{0}, n{0};            ///< world space at shutter fraction 0; n is a unit vector
    float count[kHalves] = {}; ///< samples
    float light[kLightChannels] = {};
    uint32_t cube = 0;     ///< index of its cube
    uint32_t parent = 0;   ///< index of the node in the cube of twice the size
    uint8_t face = 0;      ///< see CellId
    uint8_t ancestors = 0; ///< number of generations of parents
};

/// The recorded cells, and the larger cells that contain them.
class CellPyramid {
  public:
    /// The number of sizes above that of a recorded cell: each is twice as large as the one before. Smaller
    /// cells than the largest recorded one have more, so that the largest nodes contain all cells around
    /// them.
    static constexpr int kScales = 8;

    /// `cells`: by ascending id, so that sums of floats do not depend on the order of rendering.
    explicit CellPyramid(std::span<const JoinedCell> cells);

    /// Recorded cells keep their indices.
    size_t cellCount() const { return m_recorded.size(); }
    /// Returns the index of the node of a recorded cell.
    uint32_t nodeOf(size_t cell) const { return m_recorded[cell]; }
    std::span<const CellNode> nodes() const { return m_nodes; }
    /// Returns the edge of a node's cube, in scene units.
    float edge(const CellNode& node) const { return std::ldexp(1.f, m_cubes[node.cube].id.level); }
    /// Adds light to samples that are counted already: to a recorded cell and to all that contain it.
    void addLight(size_t cell, int part, int half, const Rgb& light);
    /// Calls work(index) for a node and all that contain it.
    template <class Work>
    void forEachAncestor(uint32_t node, const Work& work) const {
        for (; m_nodes[node].ancestors > 0; node = m_nodes[node].parent)
            work(node);
        work(node);
    }
    /// Returns the recorded cells such that those of each node follow each other.
    std::vector<uint32_t> cellsByNode() const;
    /// Calls work(index) for all nodes of the same surface and size within two cells.
    template <class Work>
    void forNeighbors(const CellNode& node, const Work& work) const;

  private:
    static constexpr uint32_t kAbsent = ~0u;
    static constexpr int kFaces = CellId::kFaces;
    /// Neighbors are nodes within kReach cells. These are found below the cubes that are 2^kGenerations times
    /// as large.
    static constexpr int kReach = 2, kGenerations = 2;
    /// All nodes of one cube: they differ in CellId::face.
    struct Cube {
        CellId id; ///< face 0
        uint32_t nodes[kFaces];
        uint32_t parent = kAbsent;
        uint32_t children[8];
    };

    static void setSums(const CellSums& sums, CellNode& node);
    void addParents();
    uint32_t findOrAddCube(CellId id);
    uint32_t findOrAddNode(uint32_t cube, uint8_t face);
    uint32_t parentOf(uint32_t cube);
    void linkCubes();
    void finishMeans();
    template <class Work>
    void forDescendants(const Cube& cube, const CellId& center, int generations, const Work& work) const;

    HugeVector<CellNode> m_nodes;
    HugeVector<Cube> m_cubes;
    IndexTable m_cubeIndices;         ///< by CellId::hash
    std::vector<uint32_t> m_recorded; ///< nodes of the recorded cells
};

/// Calls work(index) for the nodes within two cells of the center in a cube `generations` below `cube`.
template <class Work>
void CellPyramid::forDescendants(const Cube& cube, const CellId& center, int generations,
                                 const Work& work) const {
    const int size = 1 << generations;
    const auto isNear = [&](int32_t low, int32_t c) {
        const int64_t first = int64_t(low) * size;
        return first <= int64_t(c) + kReach && first + size > int64_t(c) - kReach;
    };
    if (!isNear(cube.id.x, center.x) || !isNear(cube.id.y, center.y) || !isNear(cube.id.z, center.z))
        return;
    if (generations == 0) {
        for (const uint32_t node : cube.nodes)
            if (node != kAbsent)
                work(node);
        return;
    }
    for (const uint32_t child : cube.children)
        if (child != kAbsent)
            forDescendants(m_cubes[child], center, generations - 1, work);
}

template <class Work>
void CellPyramid::forNeighbors(const CellNode& node, const Work& work) const {
    static_assert(2 * kReach + 1 <= (1 << kGenerations) + 1, "at most two ancestors in each direction");
    const CellId& id = m_cubes[node.cube].id;
    CellId ancestor = id;
    ancestor.level = int16_t(id.level + kGenerations);
    const auto index = [](int64_t coordinate) { return int32_t(coordinate >> kGenerations); };
    for (int32_t x = index(int64_t(id.x) - kReach); x <= index(int64_t(id.x) + kReach); ++x)
        for (int32_t y = index(int64_t(id.y) - kReach); y <= index(int64_t(id.y) + kReach); ++y)
            for (int32_t z = index(int64_t(id.z) - kReach); z <= index(int64_t(id.z) + kReach); ++z) {
                ancestor.x = x;
                ancestor.y = y;
                ancestor.z = z;
                if (const uint32_t cube = m_cubeIndices.find(ancestor.hash()); cube != kAbsent)
                    forDescendants(m_cubes[cube], id, kGenerations, work);
            }
}

} // namespace strobe
