// The part of the lattice that a batch's samples lie in.
#pragma once

#include "integrators/block_cache.h"
#include "integrators/slot_table.h"
#include "integrators/surface_lattice.h"

namespace strobe {

/// Gathers the cells of samples, the points around them, and the values of these that it is then given:
/// blocks, which are points in a part of the shutter. Samples take the values around them.
class BatchLattice {
  public:
    /// A point in a time bin, that some sample asks for.
    struct Block {
        uint64_t key; ///< see SurfaceLattice::keyOf
        uint32_t point, slot;
        uint32_t sample; ///< the first to ask for it
    };
    struct Settings {
        int timeBins;
        bool nearest; ///< a sample takes the value of one point, not a weighted mean
    };
    /// The lattice outlives it. `prefetchFrom`: where blocks will be looked up.
    BatchLattice(const SurfaceLattice& lattice, const Settings& settings, const BlockCache& prefetchFrom);

    /// Begins a batch of so many samples.
    void begin(size_t samples);
    /// Sample `index` of the batch takes from the lattice.
    void add(const VisibilitySample& sample, const PixelRef& pixel, uint32_t index);
    /// So do all samples of the batch's block b.
    void addAll(const VisibilityBatch& batch, size_t b);
    /// All are added.
    void finish() { locate(); }

    /// In the order in which they were asked for.
    const std::vector<Block>& blocks() const { return m_blocks; }
    const LatticeFace& faceOf(const Block& block) const { return m_points[block.point].face; }
    const LatticePoint& placeOf(const Block& block) const { return m_points[block.point].at; }
    uint32_t binOf(const Block& block) const { return binOf(m_points[block.point], block.slot); }
    void setValue(const Block& block, const Rgb& value) {
        m_values[block.point << m_binBits | block.slot] = {{value.x, value.y, value.z, 1}};
    }

    bool has(size_t sample) const { return m_shares[sample].cell != kNone; }
    /// What a sample takes of the values, which must all be set.
    Rgb valueOf(size_t sample) const {
        if (m_settings.nearest) {
            const float* v = m_values[m_nearest[sample]].numbers;
            return {v[0], v[1], v[2]};
        }
        const Share& share = m_shares[sample];
        const Cell& cell = m_cells[share.cell >> m_binBits];
        const Value* values = &m_values[slotOf(share)];
        float weights[kPoints];
        LatticeCell::weigh(cell.kind, share.place, weights);
        Value sum;
        for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k) {
            const Value& v = values[cell.point[k] << m_binBits];
            for (int c = 0; c < 4; ++c)
                sum.numbers[c] += v.numbers[c] * weights[k];
        }
        const float scale = 1 / sum.numbers[3];
        return {sum.numbers[0] * scale, sum.numbers[1] * scale, sum.numbers[2] * scale};
    }
    /// The key of the block that a sample takes most from.
    uint64_t mainKeyOf(size_t sample) const;

  private:
    /// Time bins come in eras of a few, so that cells and points are found once for all bins of an era. A
    /// bin's number in its era is its slot.
    static constexpr int kMostBinBits = 3;
    static constexpr int kPoints = LatticeCell::kPoints;
    /// A point of the batch in an era.
    struct Point {
        LatticeFace face;
        LatticePoint at;
        uint32_t era;
        uint32_t asked; ///< bits of slots: those that are among the blocks
    };
    /// A cell of the batch in an era.
    struct Cell {
        LatticeCell::Kind kind;
        uint8_t asked;           ///< bits of slots: those whose points are
        uint32_t point[kPoints]; ///< 0: there is none
    };
    /// A block's radiance, or the part of it at hand; all zero where there is no point.
    struct alignas(16) Value {
        float numbers[4]{}; ///< red, green, blue, weight
    };
    /// What a sample takes from a cell.
    struct Share {
        V3f place;     ///< in the cell
        uint32_t cell; ///< and the slot; kNone: it shares nothing
    };

    void locate();
    Cell makeCell(const LatticeCell& cell, uint32_t era);
    uint32_t pointAt(const LatticeFace& face, const LatticePoint& at, uint32_t era);
    void ask(uint32_t index, uint32_t slot, uint32_t sample);
    static int heaviestOf(const Cell& cell, const V3f& place);
    static int nearestOf(const Cell& cell, const V3f& place);
    uint32_t binOf(const Point& point, uint32_t slot) const { return point.era << m_binBits | slot; }
    uint32_t slotOf(const Share& share) const { return share.cell & ((1u << m_binBits) - 1); }

    const SurfaceLattice& m_lattice;
    const Settings m_settings;
    const BlockCache& m_cache;
    const int m_binBits; ///< of a slot
    std::vector<Point> m_points;
    std::vector<Value> m_values; ///< by point, then slot
    std::vector<Cell> m_cells;
    std::vector<Block> m_blocks;
    std::vector<Share> m_shares;     ///< by sample
    std::vector<uint32_t> m_nearest; ///< by sample, if that is what it takes: a value
    SlotTable m_pointTable, m_cellTable;

    // Samples on their way in:
    LatticeLanes m_lanes;
    uint32_t m_sampleOf[kLanes];
    alignas(64) uint32_t m_bin[kLanes];
    alignas(64) uint64_t m_key[kLanes]; ///< of a cell in an era
};

} // namespace strobe
