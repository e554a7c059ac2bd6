#include "display/live_film.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using namespace std::chrono_literals;

Film filmOf(const PixelBounds& bounds) {
    Film film(200, 100, bounds);
    for (int y = bounds.y0; y < bounds.y1; ++y)
        for (int x = bounds.x0; x < bounds.x1; ++x) {
            PixelAccumulator sum;
            sum.add(Rgb(float(x), float(y), 1), 1);
            film.add(x, y, sum);
        }
    return film;
}

TEST(LiveFilmTest, ChangedTilesAreReturnedOnce) {
    const PixelBounds bounds{10, 20, 190, 90};
    const Film film = filmOf(bounds);
    LiveFilm live(film);
    EXPECT_FALSE(live.nextChanged(0ms));
    live.update(film, {10, 20, 14, 24});
    live.update(film, {12, 22, 13, 23}); // the same 64x64 pixels
    const auto tile = live.nextChanged(0ms);
    ASSERT_TRUE(tile);
    EXPECT_EQ(tile->pixelBounds.x0, 10);
    EXPECT_EQ(tile->pixelBounds.y0, 20);
    EXPECT_EQ(tile->image.at(3, 3), Rgb(13, 23, 1));
    EXPECT_FALSE(live.nextChanged(0ms));
}

TEST(LiveFilmTest, TilesCoverThePixelBounds) {
    const PixelBounds bounds{10, 20, 190, 90};
    const Film film = filmOf(bounds);
    LiveFilm live(film);
    live.update(film, bounds);
    size_t pixels = 0;
    while (const auto tile = live.nextChanged(0ms)) {
        for (int y = tile->pixelBounds.y0; y < tile->pixelBounds.y1; ++y)
            for (int x = tile->pixelBounds.x0; x < tile->pixelBounds.x1; ++x)
                EXPECT_EQ(tile->image.at(x - tile->pixelBounds.x0, y - tile->pixelBounds.y0),
                          Rgb(float(x), float(y), 1));
        pixels += tile->image.pixels.size();
    }
    EXPECT_EQ(pixels, size_t(bounds.width()) * size_t(bounds.height()));
}

TEST(LiveFilmTest, MarkAllChangedRepeatsTheRenderedTilesOnly) {
    const PixelBounds bounds{0, 0, 200, 100};
    const Film film = filmOf(bounds);
    LiveFilm live(film);
    live.update(film, {0, 0, 1, 1});
    EXPECT_TRUE(live.nextChanged(0ms));
    live.markAllChanged();
    EXPECT_TRUE(live.nextChanged(0ms));
    EXPECT_FALSE(live.nextChanged(0ms));
}

} // namespace
} // namespace strobe
