#include "core/math/interleaved_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace strobe;

namespace {

/// Returns the number of tiles of each slice. Each pixel of the window belongs to one tile of one slice.
std::vector<size_t> tileCounts(const InterleavedTiles& tiles) {
    const PixelBounds& window = tiles.window;
    std::vector<int> uses(size_t(window.width()) * size_t(window.height()));
    std::vector<size_t> counts;
    for (uint32_t slice = 0; slice < tiles.count; ++slice) {
        const std::vector<PixelBounds> own = tilesOfSlice(tiles, slice);
        counts.push_back(own.size());
        for (const PixelBounds& tile : own)
            for (int y = tile.y0; y < tile.y1; ++y)
                for (int x = tile.x0; x < tile.x1; ++x)
                    ++uses.at(size_t(y - window.y0) * size_t(window.width()) + size_t(x - window.x0));
    }
    EXPECT_EQ(size_t(std::count(uses.begin(), uses.end(), 1)), uses.size());
    return counts;
}

TEST(InterleavedTilesTest, EachPixelBelongsToOneSlice) {
    for (const PixelBounds& window : {PixelBounds{0, 0, 24, 16}, {3, 5, 4, 45}, {7, 0, 100, 51}})
        for (const uint32_t count : {1u, 2u, 3u, 7u, 16u, 37u}) {
            const std::vector<size_t> counts = tileCounts(interleavedTiles(window, count, 16));
            EXPECT_GE(*std::min_element(counts.begin(), counts.end()), 1u) << count;
        }
    EXPECT_EQ(tileCounts(interleavedTiles({0, 0, 5, 4}, 20, 16)), std::vector<size_t>(20, 1));
}

TEST(InterleavedTilesTest, SlicesHaveAboutAsManyTiles) {
    for (const uint32_t count : {2u, 5u, 16u, 60u, 64u}) {
        const std::vector<size_t> counts = tileCounts(interleavedTiles({0, 0, 1920, 1080}, count, 64));
        const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
        EXPECT_LE(double(*most), 1.1 * double(*least) + 2) << count;
    }
}

TEST(InterleavedTilesTest, TilesOfASliceAreSpread) {
    const InterleavedTiles tiles = interleavedTiles({0, 0, 1920, 1080}, 60, 16); // 60 columns
    const std::vector<PixelBounds> own = tilesOfSlice(tiles, 3);
    for (size_t i = 0; i < own.size(); ++i)
        for (size_t k = 0; k < i; ++k) {
            const double x = (own[i].x0 - own[k].x0) / tiles.edge, y = (own[i].y0 - own[k].y0) / tiles.edge;
            EXPECT_GE(x * x + y * y, 0.7 * tiles.count) << "of a hexagonal lattice: 1.15";
        }
}

} // namespace
