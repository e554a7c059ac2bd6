// The part of the lattice that a batch's samples lie in.
#pragma once

#include "lattice/index_table.h"
#include "lattice/radiance_cache.h"
#include "lattice/surface_lattice.h"

#include <array>
#include <span>

namespace strobe {

/// What a batch's samples take, side by side for quick sums.
struct InterpolationTable {
    /// A block's radiance, or the part of it at hand, and 1; all zero where there is no point.
    using Value __attribute__((vector_size(16))) = float;
    /// For each point of a cell, the first of its values; 0: there is no point.
    using Firsts = std::array<uint32_t, LatticeCell::kPoints>;
    /// A cell in an era of time bins. Small, for they are many.
    struct Cell {
        uint32_t few[3]; ///< of three points; if there are more, the first number is where their Firsts are
        LatticeCell::Kind kind;
        bool hasMore() const { return LatticeCell::pointsOf(kind) > 3; }
        const uint32_t* firsts(const Firsts* more) const { return hasMore() ? more[few[0]].data() : few; }
    };
    static_assert(sizeof(Cell) == 16);
    /// What samples take.
    struct Shares {
        V3SoA place;                          ///< in the cell
        alignas(64) uint32_t cell[kSoAWidth]; ///< and the slot; if samples take the value of one point, that;
                                              ///< kNone: nothing
    };
};

/// Gathers the cells of samples, the points around them, and the values of these that it is then given:
/// blocks, which are points in a part of the shutter. Samples take the values around them. What was found for
/// some batches before is known still.
class BatchLattice {
  public:
    /// A point in a time bin, that some sample asks for.
    struct Block {
        uint64_t key; ///< see SurfaceLattice::keyOf
        uint32_t point, slot;
        uint32_t sample; ///< one that asks for it
    };
    struct Settings {
        int timeBins;
        bool nearest;   ///< a sample takes the value of one point, not a weighted mean
        bool remembers; ///< values too are those of the batches before: a block has one only
    };
    /// The lattice outlives it. `prefetchFrom`: where blocks will be looked up.
    BatchLattice(const SurfaceLattice& lattice, const Settings& settings, const RadianceCache& prefetchFrom);

    /// Begins a batch.
    void begin(const VisibilityBatch& batch);
    /// Some samples of the batch's block b, by lane, take from the lattice.
    void addSome(const VisibilityBatch& batch, size_t b, const int32_t* lanes, int count);
    /// So do all samples of the batch's block b, if they are in one patch. Returns whether they are.
    bool addPatch(const VisibilityBatch& batch, size_t b);
    /// So do all, wherever they are.
    void addAll(const VisibilityBatch& batch, size_t b);
    /// All are added.
    void finish() { locate(), addPatchPoints(); }

    /// Those whose values are wanted, in the order in which they were asked for.
    std::span<const Block> blocks() const { return {m_blocks.data(), m_blockCount}; }
    const LatticeFace& faceOf(const Block& block) const { return m_points[block.point].face; }
    const LatticePoint& pointOf(const Block& block) const { return m_points[block.point].at; }
    uint32_t binOf(const Block& block) const { return binOf(m_points[block.point], block.slot); }
    void setValue(const Block& block, const Rgb& value) {
        m_values[block.point << m_binBits | block.slot] = Value{value.x, value.y, value.z, 1};
    }

    bool has(size_t sample) const { return shareOf(sample) != kNone; }
    /// What each sample takes of the values, which must all be set; black if it takes none.
    void take(std::span<Rgb> values) const;
    /// The key of the block that a sample takes most from.
    uint64_t mainKeyOf(size_t sample) const;

  private:
    /// Time bins come in eras of a few, so that cells and points are found once for all bins of an era. A
    /// bin's number in its era is its slot.
    static constexpr int kMaxBinBits = 3, kSlotsOfEra = 1 << kMaxBinBits;
    static constexpr int kPoints = LatticeCell::kPoints;
    /// A point of the batch in an era.
    struct Point {
        LatticeFace face;
        LatticePoint at;
        uint32_t era;
        uint32_t asked; ///< bits of slots: those that are, or were, among the blocks
    };
    using Value = InterpolationTable::Value;
    using Cell = InterpolationTable::Cell;
    using Shares = InterpolationTable::Shares;

    void forget();
    void locate();
    void spreadCones(const VisibilitySoA& samples, int n);
    uint32_t askAtPlace(uint32_t id, uint64_t asking, uint32_t firstSample);
    uint32_t learnCell(uint32_t column, uint32_t row, uint32_t isUpper);
    uint32_t learnNode(uint32_t column, uint32_t row);
    void addPatchPoints();
    void leaveOutRepeats();
    void findCells();
    void makeCells(const int32_t* lanes, int count);
    InterpolationTable::Firsts findPoints(int lane);
    void addTriangles(size_t known);
    void shareCells();
    void shareNearest();
    uint32_t pointAt(const LatticeFace& face, const LatticePoint& at, uint64_t key, uint32_t era);
    void askAround();
    void ask(uint32_t point, uint32_t slot, uint32_t sample);
    void makeRoom(size_t blocks);
    void fileBlocks(size_t first);
    const uint32_t* firstsOf(const Cell& cell) const { return cell.firsts(m_more.data()); }
    int heaviestOf(const Cell& cell, const V3f& place) const;
    int nearestOf(const Cell& cell, const V3f& place) const;
    uint32_t slots() const { return (1u << m_binBits) - 1; }
    uint32_t binOf(const Point& point, uint32_t slot) const { return point.era << m_binBits | slot; }
    uint32_t cellAt(int i) const { return m_cellOf[m_firstOf[i]]; }
    uint32_t shareOf(size_t sample) const { return m_shares[sample / kSoAWidth].cell[sample % kSoAWidth]; }
    V3f insideOf(size_t sample) const {
        return m_shares[sample / kSoAWidth].place.at(int(sample % kSoAWidth));
    }

    const SurfaceLattice& m_lattice;
    const Settings m_settings;
    const RadianceCache& m_cache;
    const int m_binBits; ///< of a slot
    std::vector<Point> m_points;
    std::vector<Value> m_values; ///< by point, then slot; some more than there are
    std::vector<Cell> m_cells;
    std::vector<InterpolationTable::Firsts> m_more; ///< of m_cells
    std::vector<Block> m_blocks;                    ///< and room for some more
    size_t m_blockCount = 0;
    std::vector<Shares> m_shares; ///< of kSoAWidth samples each
    IndexTable m_pointTable, m_cellTable;

    // Samples on their way in:
    std::vector<RayCone> m_cones; ///< of the batch's pixels
    SurfaceCache m_surfaces;
    MeshPointCache m_places;
    LatticeSoA m_lanes;
    uint32_t m_sampleOf[kSoAWidth];
    alignas(64) uint32_t m_bin[kSoAWidth];
    alignas(64) uint64_t m_key[kSoAWidth]; ///< of a cell in an era
    alignas(64) uint64_t m_keyInBin[kSoAWidth];
    alignas(64) uint32_t m_cellOf[kSoAWidth];  ///< of the firsts
    alignas(64) uint32_t m_firstOf[kSoAWidth]; ///< the first lane in the same cell and bin, nearly always
    int32_t m_firsts[kSoAWidth];               ///< all of those
    int m_firstCount = 0;
    int32_t m_asks[kSoAWidth]; ///< of those: the first ever
    int m_askCount = 0;
    TrianglePointSoA m_newPoints;

    // Blocks of samples in patches. What these ask for is found later, for some of them together.
    static constexpr uint32_t kNew = 1u << 31; ///< a new node's number, not a point's
    PatchTable m_patchTable;
    LatticePatch m_patch;
    PatchCells m_patchCells;
    TrianglePointSoA m_newNodes;        ///< the first point of each
    HitSoA m_newNodesHits;              ///< of those, what is needed to find vertices
    uint32_t m_newNodesAt[kSoAWidth];   ///< where they are filed
    std::vector<uint32_t> m_unfinished; ///< cells some of whose points are new nodes
    struct Asking {
        uint32_t cell, slot, sample;
    };
    std::vector<Asking> m_asking; ///< for the points of cells
};

} // namespace strobe
