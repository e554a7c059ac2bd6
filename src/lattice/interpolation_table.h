// The cells and lattice points that a thread used lately, with the radiance of the points.
#pragma once

#include "core/util/index_table.h"
#include "lattice/lattice_cell.h"

#include <array>
#include <span>
#include <vector>

namespace strobe {

/// Groups of up to eight consecutive time bins: cells and points are looked up once for all bins of a group.
///
/// The index of a group, cell or point is packed with the number of a bin in the group. A packed group is a
/// time bin; a packed point is the index of the point's value in the bin.
struct TimeBinGroups {
    static constexpr int kMaxBits = 3, kMaxBins = 1 << kMaxBits;
    int bits; ///< binary logarithm of the number of bins in a group

    explicit TimeBinGroups(int timeBins);
    int binCount() const { return 1 << bits; }
    uint32_t pack(uint32_t index, uint32_t binInGroup) const { return index << bits | binInGroup; }
    uint32_t indexOf(uint32_t packed) const { return packed >> bits; }
    uint32_t binInGroup(uint32_t packed) const { return packed & ((1u << bits) - 1); }
};

/// The cells that the samples of a chunk interpolate in.
struct InterpolationSoA {
    V3SoA coords; ///< see LatticeHitSoA::coords
    /// A packed cell (TimeBinGroups); with nearest interpolation, a packed point. kNone: the sample does not
    /// use the lattice.
    alignas(64) uint32_t source[kSoAWidth];
};

/// A table of cells and lattice points in time bin groups, and of the radiance of the points in time bins
/// (their values). For one thread.
class InterpolationTable {
  public:
    /// Radiance and 1; all zero for a missing point.
    using Value __attribute__((vector_size(16))) = float;
    /// For each point of a cell the index of its value in the first bin of the group; 0: the point is
    /// missing.
    using PointValues = std::array<uint32_t, LatticeCell::kMaxPoints>;
    /// A cell in a time bin group. Its size matters: there are many.
    struct Cell {
        /// The PointValues of three points. If there are more, [0] is the index of their PointValues.
        uint32_t pointValues[3];
        LatticeCell::Kind kind;
        bool hasManyPoints() const { return LatticeCell::pointCountOf(kind) > 3; }
    };
    static_assert(sizeof(Cell) == 16);
    /// A lattice point in a time bin group.
    struct Point {
        SurfaceSide side;
        LatticePoint point;
        uint32_t group;
        uint32_t requestedBins; ///< by bit: the bins of the group in which its value is requested
    };

    explicit InterpolationTable(int timeBins);
    const TimeBinGroups& groups() const { return m_groups; }
    /// Removes all cells, points and values.
    void clear();
    /// Returns whether the table is to be cleared before the next batch. Batches near each other use many of
    /// the same cells, most of all where something moves; but a larger table would not stay in the
    /// second-level cache.
    bool isFull() const { return m_points.size() > 3000 || m_cells.size() > 6000; }

    struct CellEntry {
        uint32_t cell;
        bool wasRequested;
    };
    void prefetchCell(uint64_t key) const { m_cellIndex.prefetch(key); }
    /// Returns the cell under `key`, or `nextCell` if there is none, and whether it was requested in this bin
    /// before. A new cell must then be added with the index `nextCell`.
    CellEntry requestCell(uint64_t key, uint32_t nextCell, uint32_t binInGroup) {
        const uint32_t bit = 1u << binInGroup;
        uint32_t& entry = m_cellIndex.findOrInsert(key, nextCell << TimeBinGroups::kMaxBins);
        const CellEntry result{entry >> TimeBinGroups::kMaxBins, (entry & bit) != 0};
        entry |= bit;
        return result;
    }
    uint32_t cellCount() const { return uint32_t(m_cells.size()); }
    /// Appends a cell without points and returns its index.
    uint32_t addCell(LatticeCell::Kind kind) {
        m_cells.push_back({{}, kind});
        return cellCount() - 1;
    }
    Cell& cell(uint32_t index) { return m_cells[index]; }
    void setPoints(Cell& cell, const PointValues& points);
    const uint32_t* pointValuesOf(const Cell& cell) const {
        return cell.hasManyPoints() ? m_manyPoints[cell.pointValues[0]].data() : cell.pointValues;
    }

    void prefetchPoint(uint64_t key) const { m_pointIndex.prefetch(key); }
    /// Returns the index of the point under `key`, which is SurfaceLattice::keyOf in the first bin of the
    /// group.
    uint32_t findOrAddPoint(uint64_t key, const SurfaceSide& side, const LatticePoint& point, uint32_t group);
    Point& point(uint32_t index) { return m_points[index]; }
    const Point& point(uint32_t index) const { return m_points[index]; }
    void setValue(uint32_t point, uint32_t binInGroup, const Rgb& radiance) {
        m_values[m_groups.pack(point, binInGroup)] = Value{radiance.x, radiance.y, radiance.z, 1};
    }

    /// Writes the interpolated radiance of samples 0 … values.size()-1 of a chunk. The values of all their
    /// points must be set. Samples that do not use the lattice are black.
    void interpolate(const InterpolationSoA& samples, std::span<Rgb> values) const;
    /// The same with nearest interpolation.
    void interpolateNearest(const InterpolationSoA& samples, std::span<Rgb> values) const;
    /// Returns the element of PointValues of the point with the greatest weight.
    uint32_t heaviestPointValue(uint32_t cell, const V3f& coords) const;
    /// Returns the element of PointValues of the nearest point. If a Grid misses that point, returns another
    /// one, along as few edges of the cell as possible.
    uint32_t nearestPointValue(uint32_t cell, const V3f& coords) const;

  private:
    const TimeBinGroups m_groups;
    std::vector<Cell> m_cells;
    std::vector<PointValues> m_manyPoints; ///< of cells with more than three points
    std::vector<Point> m_points;           ///< [0] is the missing point
    std::vector<Value> m_values;           ///< by packed point; larger than needed
    /// By key in the group: the cell, shifted by kMaxBins, and a bit for each bin in which it is requested.
    IndexTable m_cellIndex;
    IndexTable m_pointIndex; ///< by key in the first bin of the group
};

} // namespace strobe
