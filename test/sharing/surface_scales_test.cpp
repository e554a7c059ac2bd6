// How large cells are beside their surfaces.
#include "sharing/surface_scales.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace strobe {
namespace {

/// Returns a cell on a surface, with a sample at its center.
CellSums cellOf(uint64_t surface, int x, int level) {
    CellSums sums;
    sums.id = {surface, x, 0, 0, int16_t(level), 4};
    for (auto& p : sums.p)
        p = int64_t(1) << (CellSums::kPositionBits - 1);
    sums.n[2] = int64_t(1) << CellSums::kNormalBits;
    sums.count[0] = 1;
    return sums;
}

TEST(SurfaceScales, CountDoublings) {
    std::vector<CellSums> cells;
    for (int x = 0; x < 9000; ++x) // longer than a run of cells
        cells.push_back(cellOf(1, x, 0));
    for (int x = 0; x < 33; ++x) // 32 edges from the first to the last center
        cells.push_back(cellOf(2, x, -1));
    cells.push_back(cellOf(3, 0, 2)); // no extent
    for (int x : {0, 8, 130, 136})    // cells of edges 1 and 1/8, whose surface is 16.4 units long
        cells.push_back(cellOf(4, x, x < 100 ? 0 : -3));
    std::sort(cells.begin(), cells.end(),
              [](const CellSums& a, const CellSums& b) { return precedes(a.id, b.id); });
    const std::span<const CellSums> tile = cells;
    const CellPyramid pyramid(joinCells({&tile, 1}).cells, LightParts::all());
    const HugeVector<uint8_t> scales = surfaceScales(pyramid);
    ASSERT_EQ(scales.size(), cells.size());
    for (size_t i = 0; i < cells.size(); ++i) {
        const CellId& id = cells[i].id;
        const int expected = id.surface == 1   ? CellPyramid::kScales
                             : id.surface == 2 ? 3
                             : id.surface == 3 ? 0
                             : id.level == 0   ? 3
                                               : 6;
        EXPECT_EQ(scales[i], expected) << id.surface << " " << id.x;
    }
}

} // namespace
} // namespace strobe
