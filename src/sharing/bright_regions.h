// Regions of several sizes around the cells of a surface, and the bright samples in them.
#pragma once

#include "sharing/cell_pyramid.h"

#include <algorithm>
#include <functional>

namespace strobe {

/// Sums over bright samples, weighted.
struct BrightSums {
    float brightness = 0, squares = 0;
    Rgb rare = Rgb(0); ///< their rare light
    /// Returns the number of equally bright samples whose noise is that of these samples.
    float effectiveCount() const { return squares > 0 ? sqr(brightness) / squares : 0; }
};

/// Returns the weight of a mean over a number of equal things: 0 up to half of what is enough.
inline float weightOf(float count, float enough) { return std::clamp(2 * count / enough - 1, 0.f, 1.f); }

/// A region around a cell.
struct BrightRegion {
    BrightSums sums;
    float count;  ///< of all samples, weighted
    float weight; ///< of the region among those of the cell
    float rest;   ///< the weight that the regions of the cell leave, if this is the largest
    int size;     ///< generations from the node of the cell to the nodes of the region
};

/// The regions around recorded cells: the nodes of one size around a cell on the same surface, weighted by a
/// bell of the distance. The smallest have the size of the cell's own node, the largest a fourth of that of
/// the surface.
class BrightRegions {
  public:
    static constexpr int kSizes = CellPyramid::kScales + 1;
    /// The regions of a cell that are visited: up to the first with enough bright samples, or all.
    enum class Extent { Enough, All };
    using Visit = std::function<void(uint32_t cell, const BrightRegion&)>;

    /// There are no bright samples yet. The pyramid outlives this object.
    explicit BrightRegions(const CellPyramid& pyramid);
    /// Calls add(sums, size) for all nodes that contain a cell. `size`: generations from the cell.
    template <class Add>
    void addTo(uint32_t cell, const Add& add) {
        int size = 0;
        m_pyramid.forEachAncestor(m_pyramid.nodeOf(cell), [&](uint32_t node) { add(m_sums[node], size++); });
    }
    /// Removes all samples.
    void clear();
    /// Returns the size of the largest region of a cell.
    int largestSize(uint32_t cell) const { return m_scales[cell]; }
    /// Calls `visit` for regions of increasing size around each cell. The first has weight as far as it has
    /// enough bright samples, the next has what is left, and so on. The weights and the rest of the largest
    /// region sum to 1. Regions without bright samples are left out, and so are most of those with very few.
    /// `cells`: in the order of CellPyramid::cellsByNode, in which consecutive ones have the same nodes
    /// around them. Different cells may be visited by different threads.
    void forEach(std::span<const uint32_t> cells, Extent extent, const Visit& visit) const;
    /// Returns the smallest region around a cell, with half of its radius.
    BrightRegion coreOf(uint32_t cell) const;

  private:
    struct Query;
    class Surroundings;
    void visitRun(std::span<const uint32_t> cells, Extent extent, const Visit& visit) const;
    void visitSize(const Surroundings& surroundings, std::span<Query> queries, int size, Extent extent,
                   const Visit& visit) const;
    bool hasMore(uint32_t node) const;

    const CellPyramid& m_pyramid;
    HugeVector<BrightSums> m_sums;      ///< by node
    const HugeVector<uint8_t> m_scales; ///< of the largest regions, by cell
};

} // namespace strobe
