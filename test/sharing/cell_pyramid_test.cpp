// The neighbors of cells.
#include "sharing/cell_pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace strobe {
namespace {

/// Returns random cells of two surfaces around the origin, by ascending id, with one sample each.
std::vector<CellSums> randomCells(std::mt19937& random) {
    std::uniform_int_distribution<int32_t> coordinate(-9, 9), other(0, 1);
    std::map<CellId, CellSums> cells;
    for (int i = 0; i < 900; ++i) {
        CellSums sums;
        sums.id = {uint64_t(7 + other(random)), coordinate(random), coordinate(random),
                   coordinate(random),          int16_t(3),         uint16_t(4 * other(random))};
        sums.count[0] = 1;
        cells.emplace(sums.id, sums);
    }
    std::vector<CellSums> out;
    for (const auto& [id, sums] : cells)
        out.push_back(sums);
    return out;
}

bool areNeighbors(const CellId& a, const CellId& b) {
    const int32_t distances[] = {a.x - b.x, a.y - b.y, a.z - b.z};
    return a.surface == b.surface && std::all_of(std::begin(distances), std::end(distances),
                                                 [](int32_t d) { return std::abs(d) <= 2; });
}

/// In any order of the nodes.
TEST(CellPyramid, NeighborsAreWithinTwoCells) {
    std::mt19937 random(1);
    std::vector<CellSums> cells = randomCells(random);
    const std::span<CellSums> tile = cells;
    const CellPyramid pyramid(joinCells({&tile, 1}).cells, LightParts::all());
    std::vector<uint32_t> order(cells.size());
    for (uint32_t i = 0; i < order.size(); ++i)
        order[i] = i;
    CellPyramid::Neighbors neighbors(pyramid);
    for (const bool isShuffled : {false, true}) {
        if (isShuffled)
            std::shuffle(order.begin(), order.end(), random);
        for (const uint32_t cell : order) {
            std::vector<uint32_t> expected;
            for (uint32_t i = 0; i < cells.size(); ++i)
                if (areNeighbors(cells[i].id, cells[cell].id))
                    expected.push_back(pyramid.nodeOf(i));
            const std::span<const uint32_t> around = neighbors.of(pyramid.nodeOf(cell));
            std::vector<uint32_t> found(around.begin(), around.end());
            std::sort(expected.begin(), expected.end());
            std::sort(found.begin(), found.end());
            EXPECT_EQ(found, expected) << cell;
        }
    }
}

} // namespace
} // namespace strobe
