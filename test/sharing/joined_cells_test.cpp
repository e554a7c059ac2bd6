#include "sharing/records/joined_cells.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace strobe {
namespace {

using SumsById = std::map<CellId, CellSums, decltype(&precedes)>;

/// Returns the cells of tiles whose ids repeat in other tiles; enough cells for several parts.
std::vector<std::vector<CellSums>> randomTiles() {
    std::mt19937 random(1);
    std::vector<std::vector<CellSums>> tiles(9);
    for (size_t tile = 0; tile < tiles.size(); ++tile) {
        SumsById cells(precedes); // with different ids; tile 4 has none
        for (size_t i = 0; i < (tile == 4 ? 0 : 3000 * tile); ++i) {
            CellSums cell;
            cell.id = {random() % 3,           int32_t(random() % 40) - 20,
                       int32_t(random() % 40), int32_t(random() % 3),
                       int16_t(random() % 2),  uint16_t(random() % CellId::kFaces)};
            if (i % 16 == 0) // so small that its code is that of others
                cell.id.level = int16_t(cell.id.level - 24);
            if (i % 32 == 0)
                cell.id.y -= CellId::kMaxIndex;
            cell.count[0] = random() % 100;
            cell.p[1] = int64_t(random());
            cell.light[1][0].add(Rgb(float(random() % 8)));
            cells.emplace(cell.id, cell);
        }
        for (const auto& [id, cell] : cells)
            tiles[tile].push_back(cell);
        std::shuffle(tiles[tile].begin(), tiles[tile].end(), random);
    }
    return tiles;
}

TEST(JoinedCells, HaveTheSumsOfAllTiles) {
    const std::vector<std::vector<CellSums>> tiles = randomTiles();
    SumsById expected(precedes);
    for (const auto& tile : tiles)
        for (const CellSums& cell : tile)
            if (const auto [at, isNew] = expected.emplace(cell.id, cell); !isNew)
                at->second.add(cell);
    const JoinedCells joined = joinCells(std::vector<std::span<const CellSums>>(tiles.begin(), tiles.end()));
    ASSERT_EQ(joined.cells.size(), expected.size());
    size_t i = 0;
    for (const auto& [id, sums] : expected) {
        EXPECT_EQ(joined.cells[i].id, id);
        const JoinedCell& cell = joined.cells[i++];
        EXPECT_EQ(cell.count[0], float(sums.count[0]));
        const double offset = double(sums.p[1]) / (1 << CellSums::kPositionBits);
        EXPECT_EQ(cell.p[1], float((double(sums.count[0]) * id.y + offset) * std::ldexp(1.0, id.level)));
        EXPECT_EQ(cell.light[1][0], sums.light[1][0].value());
    }
    for (size_t tile = 0; tile < tiles.size(); ++tile)
        for (size_t k = 0; k < tiles[tile].size(); ++k)
            EXPECT_EQ(joined.cells[joined.numbers[tile][k]].id, tiles[tile][k].id);
}

TEST(JoinedCells, NoTilesHaveNoCells) {
    EXPECT_TRUE(joinCells({}).cells.empty());
    EXPECT_TRUE(joinCells(std::vector<std::span<const CellSums>>(3)).cells.empty());
}

} // namespace
} // namespace strobe
