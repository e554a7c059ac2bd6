#include "core/film/heatmap.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

TEST(Heatmap, ColorsRangeFromBlueToRed) {
    Film film(200, 4, {0, 0, 200, 4}, {Aov::Shades, Aov::ShadeTime});
    for (int x = 0; x < 200; ++x) {
        film.setLayerValue(0, x, 0, float(x % 65));
        film.setLayerValue(1, x, 0, x == 0 ? -1.f : 1.f);
    }
    const Image shades = heatmap(film, Aov::Shades, 64);
    EXPECT_EQ(shades.width, 200);
    EXPECT_GT(shades.height, 20) << "the color bar";
    EXPECT_EQ(shades.at(0, 0), Rgb(0)) << "no shade: black";
    EXPECT_GT(shades.at(1, 0).z, 4 * shades.at(1, 0).x) << "one shade: blue";
    EXPECT_GT(shades.at(64, 0).x, 4 * shades.at(64, 0).z) << "all shades: red";
    const Image time = heatmap(film, Aov::ShadeTime, 64);
    EXPECT_EQ(time.at(0, 0), Rgb(0)) << "no shade: black";
    EXPECT_GT(time.at(1, 0).x, 4 * time.at(1, 0).z);
}

} // namespace
} // namespace strobe
