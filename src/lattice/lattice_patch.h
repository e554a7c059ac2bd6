// Patches: parts of one static triangle that all hits of a chunk divide alike. Their cells are found by
// column and row, without keys.
#pragma once

#include "lattice/lattice_division.h"
#include "lattice/lattice_soa.h"
#include "lattice/surface_cache.h"

namespace strobe {

/// A triangle that some hits divide alike: a grid of `nu` columns along u and `nv` rows along v. Each grid
/// cell holds a lower and an upper lattice cell; the grid's nodes are the lattice points.
struct LatticePatch {
    uint32_t instance, geometry, prim;
    uint64_t keySum; ///< see LatticeHitSoA::keySum
    float nu, nv;
    bool isFront; ///< see SurfaceSide

    /// Sets nu, nv and isFront, and returns true, if all hits, which are on this triangle, divide it alike
    /// and see the same side. May return false where the ranges of their projected lengths do not decide it.
    /// `edges` are in world space; `cones` are those of the samples' pixels.
    bool findDivision(const VisibilitySoA& samples, int count, const Edges& edges, const RayConeSoA& cones,
                      float blockSizeInPixels, bool sharesSmall);
};

/// The cells of a patch in which the hits of a chunk lie. An id numbers the cells of a rectangle of the
/// patch's grid.
class PatchCells {
  public:
    static constexpr int kMaxIds = 2 * kSoAWidth;
    /// Finds the cells of `count` hits in the patch and writes LatticeHitSoA::coords. Each hit's result
    /// depends on its own (u, v) only. Returns false if the hits are too far apart.
    bool find(const LatticePatch& patch, const HitSoA& hits, int count, V3SoA& coords);

    /// The cell of hit number h, below idCount().
    uint32_t idOf(int h) const { return m_id[h]; }
    /// At most kMaxIds.
    int idCount() const { return m_idCount; }
    /// Whether a hit lies in the cell: bit id % 64 of word id / 64.
    const uint64_t (&occupied() const)[kMaxIds / 64] { return m_occupied; }
    uint32_t columnOf(uint32_t id) const { return m_firstColumn + (id >> 1 & ((1u << m_columnBits) - 1)); }
    uint32_t rowOf(uint32_t id) const { return m_firstRow + (id >> (1 + m_columnBits)); }
    static bool isUpper(uint32_t id) { return id & 1; }

  private:
    alignas(64) uint32_t m_id[kSoAWidth];
    int m_idCount;
    uint64_t m_occupied[kMaxIds / 64];
    uint32_t m_firstColumn, m_firstRow;
    int m_columnBits;
};

/// A table of recent cells and nodes of patches. An entry's index is computed from column and row modulo
/// kEdge; a new entry replaces the one with the same index. Tags identify the patch and the tile of kEdge x
/// kEdge grid cells.
class PatchTable {
  public:
    struct Cell {
        uint64_t tag = 0;
        uint32_t cell;          ///< index into InterpolationTable
        uint32_t requestedBins; ///< by bit: the bins of the group in which the cell's points are requested
    };
    struct Node {
        uint64_t tag = 0;
        uint32_t point; ///< index into InterpolationTable
    };
    void clear();
    /// Selects the patch that the columns and rows of the other functions refer to.
    void select(const LatticePatch& patch);
    /// Returns the tag of an entry; an entry with another tag is of another patch or tile.
    uint64_t tagOf(uint32_t column, uint32_t row) const {
        static_assert(kMaxDivision - kEdgeBits < 16);
        return uint64_t(m_selected) << 32 | (row >> kEdgeBits << 16 | column >> kEdgeBits);
    }
    Cell& cell(uint32_t column, uint32_t row, bool isUpper) {
        return m_cells[2 * nodeIndex(column, row) + isUpper];
    }
    /// Patches are shifted against each other, so that the same columns and rows of several fit into the
    /// table.
    uint32_t nodeIndex(uint32_t column, uint32_t row) const {
        return ((row + 3 * m_selected) % kEdge) << kEdgeBits | (column + 7 * m_selected) % kEdge;
    }
    Node& node(uint32_t index) { return m_nodes[index]; }

  private:
    static constexpr int kEdgeBits = 5;
    static constexpr uint32_t kEdge = 1 << kEdgeBits;
    static constexpr size_t kPatches = 8;
    struct NumberedPatch {
        LatticePatch patch;
        uint32_t number = 0; ///< 0: no patch
    };
    NumberedPatch m_patches[kPatches];
    uint32_t m_selected = 0;   ///< number of the selected patch
    uint32_t m_lastNumber = 0; ///< numbers are not used again
    std::vector<Cell> m_cells = std::vector<Cell>(2 * kEdge * kEdge);
    std::vector<Node> m_nodes = std::vector<Node>(kEdge * kEdge);
};

} // namespace strobe
