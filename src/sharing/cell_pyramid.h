// Cells of several sizes, and their neighbors.
#pragma once

#include "core/util/index_table.h"
#include "core/util/memory.h"
#include "sharing/records/joined_cells.h"

#include <bitset>
#include <span>

namespace strobe {

/// The mean of one part of the light of a node's samples: RGB by half.
struct NodeLight {
    static constexpr int kChannels = 3 * kHalves;
    float of[kChannels] = {};
};

/// A cell of any size with the mean position and the mean shading normal of all its samples.
struct CellNode {
    V3f p{0}, n{0};            ///< world space at shutter fraction 0; n is a unit vector
    float count[kHalves] = {}; ///< samples
    uint32_t cube = 0;         ///< index of its cube
    uint32_t parent = 0;       ///< index of the node in the cube of twice the size
    uint8_t face = 0;          ///< see CellId
    uint8_t ancestors = 0;     ///< number of generations of parents
};

/// The recorded cells, and the larger cells that contain them.
class CellPyramid {
  public:
    /// The number of sizes above that of a recorded cell: each is twice as large as the one before. Smaller
    /// cells than the largest recorded one have more, so that the largest nodes contain all cells around
    /// them.
    static constexpr int kScales = 8;

    /// `cells`: in the order of `precedes`, each with samples. `parts`: those that were recorded.
    CellPyramid(std::span<const JoinedCell> cells, LightParts parts);

    /// Recorded cells keep their indices.
    size_t cellCount() const { return m_recorded.size(); }
    /// Returns the index of the node of a recorded cell.
    uint32_t nodeOf(size_t cell) const { return m_recorded[cell]; }
    std::span<const CellNode> nodes() const { return m_nodes; }
    LightParts parts() const { return m_parts; }
    /// Returns the light of a node. Precondition: the part was recorded.
    const NodeLight& light(LightPart part, uint32_t node) const { return m_light[int(part)][node]; }
    /// Returns the surface of a node: see CellId. Recorded cells of a surface follow each other.
    uint64_t surfaceOf(const CellNode& node) const { return m_cubes[node.cube].id.surface; }
    /// Returns the edge of a node's cube, in scene units.
    float edge(const CellNode& node) const { return std::ldexp(1.f, m_cubes[node.cube].id.level); }
    /// Adds light to samples that are counted already: to a recorded cell and to all that contain it.
    /// Precondition: the part was recorded.
    void addLight(size_t cell, LightPart part, int half, const Rgb& light);
    /// Calls work(index) for a node and all that contain it.
    template <class Work>
    void forEachAncestor(uint32_t node, const Work& work) const {
        for (; m_nodes[node].ancestors > 0; node = m_nodes[node].parent)
            work(node);
        work(node);
    }
    /// Returns the recorded cells such that those of each node follow each other, but for a few.
    std::vector<uint32_t> cellsByNode() const;
    class Neighbors;

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

    class Builder;
    void indexBlocks();
    void finishMeans();

    const LightParts m_parts;
    /// Nodes and cubes precede those inside them.
    HugeBuffer<CellNode> m_nodes;
    HugeBuffer<NodeLight> m_light[kParts]; ///< by node; empty: not recorded
    HugeBuffer<Cube> m_cubes;
    IndexTable m_blocks;             ///< the cubes that Neighbors looks up: by CellId::hash
    HugeBuffer<uint32_t> m_recorded; ///< nodes of the recorded cells
};

/// Finds the nodes of the same surface and size within two cells of a node. Most of the work is shared by
/// nodes that are near the one before, as those in the order of cellsByNode.
class CellPyramid::Neighbors {
  public:
    explicit Neighbors(const CellPyramid& pyramid) : m_pyramid(pyramid) {}
    /// Returns the indices of the nodes around a node. Valid until the next call.
    std::span<const uint32_t> of(uint32_t node);

  private:
    /// A node, and the cells of the block that are near it: bit x + 4 y + 16 z.
    struct Candidate {
        uint64_t cells;
        uint32_t node;
    };
    void visitCubesAround(int x, int y, int z);
    void addDescendants(const Cube& cube);

    const CellPyramid& m_pyramid;
    CellId m_block; ///< the cube of 4x4x4 cells of the last node
    /// The cubes of the same size around it whose nodes are among the candidates; none: no block yet.
    std::bitset<27> m_visited;
    std::vector<Candidate> m_candidates;
    std::vector<uint32_t> m_found;
};

} // namespace strobe
