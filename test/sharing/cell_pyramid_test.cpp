// The order of cells, the sums of larger ones, and the neighbors of cells.
#include "sharing/cell_pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <tuple>

namespace strobe {
namespace {

/// Returns cells of several sizes and faces on two surfaces, in random order, with a sample at each center.
std::vector<CellSums> cellsOfSeveralSizes(std::mt19937& random) {
    std::vector<CellSums> cells;
    for (int i = 0; i < 9000; ++i) {
        CellSums sums;
        const int level = int(random() % 4) - 2;
        const auto coordinate = [&] { return (int32_t(random() % 64) - 16) >> (level + 2); };
        sums.id = {random() % 2, coordinate(),   coordinate(),
                   coordinate(), int16_t(level), uint16_t(random() % CellId::kFaces)};
        const auto isSame = [&](const CellSums& other) { return other.id == sums.id; };
        if (std::any_of(cells.begin(), cells.end(), isSame))
            continue;
        for (int k = 0; k < 3; ++k)
            sums.p[k] = int64_t(1) << (CellSums::kPositionBits - 1);
        sums.n[2] = int64_t(1) << CellSums::kNormalBits;
        sums.count[1] = 1;
        sums.light[0][1].add(Rgb(float(random() % 16)));
        cells.push_back(sums);
    }
    return cells;
}

TEST(CellId, CellsOfACubeFollowEachOther) {
    std::mt19937 random(1);
    std::vector<CellSums> cells = cellsOfSeveralSizes(random);
    std::sort(cells.begin(), cells.end(),
              [](const CellSums& a, const CellSums& b) { return precedes(a.id, b.id); });
    for (int level = -1; level < 5; ++level) {
        using Cube = std::tuple<uint64_t, int32_t, int32_t, int32_t>;
        std::set<Cube> visited;
        std::optional<Cube> last;
        for (const CellSums& cell : cells) {
            if (cell.id.level > level)
                continue;
            const CellId cube = cell.id.ancestor(level);
            const Cube current(cube.surface, cube.x, cube.y, cube.z);
            if (current != last) {
                EXPECT_TRUE(visited.insert(current).second);
            }
            last = current;
        }
    }
    for (size_t i = 1; i < cells.size(); ++i)
        for (size_t k = i > 32 ? i - 32 : 0; k < i; ++k)
            if (cells[i].id.level > cells[k].id.level) { // then it does not contain the cell before it
                const CellId inLarger = cells[k].id.ancestor(cells[i].id.level);
                EXPECT_FALSE(inLarger.surface == cells[i].id.surface && inLarger.x == cells[i].id.x &&
                             inLarger.y == cells[i].id.y && inLarger.z == cells[i].id.z);
            }
}

TEST(CellId, OppositeSidesOfTheOriginHaveNoCommonCube) {
    EXPECT_EQ(commonLevel({1, -1, 0, 0, 3, 0}, {1, 0, 0, 0, 3, 0}), std::numeric_limits<int>::max());
    EXPECT_EQ(commonLevel({1, 4, 0, 0, 3, 0}, {1, 7, 0, 0, 3, 2}), 5);
    EXPECT_EQ(commonLevel({1, 4, 9, 0, 3, 0}, {1, 4, 9, 0, 3, 2}), 3);
    EXPECT_EQ(commonLevel({1, 4, 9, 0, 3, 0}, {1, 1, 2, 0, 5, 2}), 5);
}

/// As found cell by cell. The pyramid is built from several runs of cells.
TEST(CellPyramid, NodesHaveTheMeansOfTheirCells) {
    std::mt19937 random(1);
    std::vector<CellSums> tile = cellsOfSeveralSizes(random);
    const std::span<const CellSums> cells = tile;
    const JoinedCells joined = joinCells({&cells, 1});
    const CellPyramid pyramid(joined.cells, LightParts::all());
    ASSERT_EQ(pyramid.cellCount(), tile.size());
    struct Sum {
        double count = 0, light = 0;
        V3f p{0};
    };
    std::vector<Sum> expected(pyramid.nodes().size());
    std::set<std::tuple<uint64_t, int32_t, int32_t, int32_t, int, int>> ids;
    for (uint32_t cell = 0; cell < pyramid.cellCount(); ++cell) {
        const CellId& id = joined.cells[cell].id;
        const float edge = std::ldexp(1.f, id.level);
        EXPECT_EQ(pyramid.nodes()[pyramid.nodeOf(cell)].face, id.face);
        int level = id.level;
        pyramid.forEachAncestor(pyramid.nodeOf(cell), [&](uint32_t node) {
            EXPECT_EQ(pyramid.edge(pyramid.nodes()[node]), std::ldexp(1.f, level));
            const CellId larger = id.ancestor(level++);
            ids.emplace(larger.surface, larger.x, larger.y, larger.z, larger.level, larger.face);
            expected[node].count += 1;
            expected[node].light += double(joined.cells[cell].light[0][1].x);
            expected[node].p += V3f(float(id.x) + 0.5f, float(id.y) + 0.5f, float(id.z) + 0.5f) * edge;
        });
        EXPECT_EQ(level, 1 + CellPyramid::kScales + 1); // the largest cells have level 1
    }
    EXPECT_EQ(ids.size(), pyramid.nodes().size());
    for (uint32_t i = 0; i < expected.size(); ++i) {
        const CellNode& node = pyramid.nodes()[i];
        const auto count = float(expected[i].count);
        EXPECT_EQ(node.count[1], count);
        EXPECT_NEAR(pyramid.light(LightPart::Direct, i).of[3], expected[i].light / expected[i].count, 1e-4);
        EXPECT_NEAR(length2(node.p - expected[i].p * (1 / count)), 0, 1e-4f);
    }
    std::vector<uint32_t> order = pyramid.cellsByNode();
    std::sort(order.begin(), order.end());
    for (uint32_t i = 0; i < order.size(); ++i)
        EXPECT_EQ(order[i], i);
}

/// Returns random cells of two surfaces around the origin in the order of `precedes`, with one sample each.
std::vector<CellSums> randomCells(std::mt19937& random) {
    std::uniform_int_distribution<int32_t> coordinate(-9, 9), other(0, 1);
    std::map<CellId, CellSums, decltype(&precedes)> cells(precedes);
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
    const std::span<const CellSums> tile = cells;
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
