// Hits of a block that are all on one triangle: their cells are found by where they lie instead of by keys.
#pragma once

#include "lattice/lattice_division.h"
#include "lattice/lattice_soa.h"
#include "lattice/surface_cache.h"

namespace strobe {

/// A triangle that is divided alike for all of some hits, and into cells of blocks: a regular mesh of columns
/// of u and rows of v, two cells in each place, whose nodes are the points.
struct LatticePatch {
    uint32_t instance, geometry, prim;
    uint64_t keySum; ///< with which the triangle's keys begin
    float nu, nv;    ///< see LatticeCell
    bool positive;   ///< see LatticeFace

    /// Whether hits, all of this triangle, are such. False as well where that takes more to tell.
    bool divide(const VisibilitySoA& samples, int count, const Edges& edges, const LatticeSoA& cones,
                float blockSize, bool sharesSmall);
};

/// The cells of a patch that hits are in.
struct PatchCells {
    static constexpr int kMax = 2 * kSoAWidth;
    /// Where hits lie; each is a function of its own (u, v). False: too far apart.
    bool find(const LatticePatch& patch, const HitSoA& hits, int count, V3SoA& place);

    alignas(64) uint32_t id[kSoAWidth]; ///< a hit's cell, below kMax
    int count;                          ///< ids are below
    uint64_t any[kMax / 64];            ///< bits of those that some hit is in
    uint32_t columnOf(uint32_t id) const { return firstColumn + (id >> 1 & ((1u << columnBits) - 1)); }
    uint32_t rowOf(uint32_t id) const { return firstRow + (id >> (1 + columnBits)); }
    static bool isUpper(uint32_t id) { return id & 1; }

    uint32_t firstColumn, firstRow;
    int columnBits;

  private:
    alignas(64) uint32_t m_column[kSoAWidth], m_row[kSoAWidth], m_isUpper[kSoAWidth];
};

/// The cells of patches that were asked for lately, and their nodes: each is filed under its column and row
/// in tiles of so many, all of which share one file. What falls on the same place replaces what was there;
/// tags tell them apart.
class PatchTable {
  public:
    struct Cell {
        uint64_t tag = 0;
        uint32_t number; ///< of BatchLattice's cells
        uint32_t asked;  ///< bits of slots: those whose points are
    };
    struct Node {
        uint64_t tag = 0;
        uint32_t point;
    };
    void clear();
    /// From here on, columns and rows are those of this patch.
    void open(const LatticePatch& patch);
    /// What has this tag is found here, or something else is.
    uint64_t tagOf(uint32_t column, uint32_t row) const {
        static_assert(kMaxDivide - kEdgeBits < 16);
        return uint64_t(m_patch) << 32 | (row >> kEdgeBits << 16 | column >> kEdgeBits);
    }
    Cell& cell(uint32_t column, uint32_t row, bool isUpper) {
        return m_cells[2 * placeOf(column, row) + isUpper];
    }
    uint32_t placeOf(uint32_t column, uint32_t row) const { // patches are shifted, for all to have room
        return ((row + 3 * m_patch) % kEdge) << kEdgeBits | (column + 7 * m_patch) % kEdge;
    }
    Node& node(uint32_t place) { return m_nodes[place]; }

  private:
    static constexpr int kEdgeBits = 5;
    static constexpr uint32_t kEdge = 1 << kEdgeBits;
    struct Numbered {
        LatticePatch patch;
        uint32_t number = 0;
    };
    static constexpr size_t kPatches = 8;
    Numbered m_patches[kPatches];
    uint32_t m_patch = 0; ///< the number of the open one
    uint32_t m_last = 0;  ///< number given; 0 is no patch's
    std::vector<Cell> m_cells = std::vector<Cell>(2 * kEdge * kEdge);
    std::vector<Node> m_nodes = std::vector<Node>(kEdge * kEdge);
};

} // namespace strobe
