// The film's layers against what the integrators must do, and the pictures made of them.
#include "core/film/heatmap.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

const std::vector<Aov> kAll = {Aov::Shades, Aov::Samples, Aov::HitRate, Aov::Cell, Aov::ShadeTime};

/// The left half of the frame is a wall, the right half is empty.
std::string halfWall() {
    return "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 8\nSampler \"sobol\" \"integer "
           "pixelsamples\" 16\nIntegrator \"directlighting\"\nCamera \"orthographic\" \"float screenwindow\" "
           "[-2 2 "
           "-1 1]\nWorldBegin\nLightSource \"infinite\"\nMaterial \"matte\"\nShape \"trianglemesh\" "
           "\"integer "
           "indices\" [0 1 2] \"point P\" [0 -9 5 0 9 5 -99 0 5]\n";
}

struct Shown {
    Film film;
    RenderStats stats;
};

Shown show(const std::string& text, const std::string& integrator, int threads = 1, int tile = 64) {
    BuildOptions options;
    options.integrator = integrator;
    const BuiltScene built = test::build(text, options);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.threads = threads, settings.tileSize = tile;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds, kAll);
    RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                               *built.filter, settings, film);
    return {std::move(film), std::move(stats)};
}

double sum(const std::vector<float>& plane) {
    double total = 0;
    for (float v : plane)
        total += double(v);
    return total;
}

TEST(Layers, SupersampleShadesEverySample) {
    const Film film = show(halfWall(), "supersample").film;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) {
            const size_t i = size_t(y * 16 + x);
            const bool wall = x < 8;
            EXPECT_EQ(film.plane(Aov::Shades)[i], wall ? 16 : 0);
            EXPECT_EQ(film.plane(Aov::Samples)[i], 16);
            EXPECT_EQ(film.plane(Aov::HitRate)[i], 0);
            EXPECT_EQ(film.plane(Aov::Cell)[i], 0);
            if (wall)
                EXPECT_NEAR(film.plane(Aov::ShadeTime)[i], 0.5, 1. / 32); // one in each sixteenth
            else
                EXPECT_EQ(film.plane(Aov::ShadeTime)[i], -1);
        }
}

TEST(Layers, MsaaShadesOnceAPixel) {
    const Film film = show(halfWall(), "msaa").film;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
            EXPECT_EQ(film.plane(Aov::Shades)[size_t(y * 16 + x)], 1);
            EXPECT_FLOAT_EQ(film.plane(Aov::HitRate)[size_t(y * 16 + x)], 15.f / 16);
        }
}

TEST(Layers, AddUpToTheStatistics) {
    for (const char* integrator : {"supersample", "msaa", "msaa-cache"})
        for (int threads : {1, 3}) {
            const Shown shown = show(halfWall(), integrator, threads, 4);
            EXPECT_EQ(sum(shown.film.plane(Aov::Shades)), double(shown.stats.total.shades)) << integrator;
        }
}

TEST(Layers, BlocksNameWhatIsShared) {
    const Film film = show(halfWall(), "msaa-cache").film;
    std::vector<float> blocks(film.plane(Aov::Cell).begin(), film.plane(Aov::Cell).begin() + 8);
    for (float block : blocks)
        EXPECT_GT(block, 0);
    std::sort(blocks.begin(), blocks.end());
    EXPECT_GT(std::unique(blocks.begin(), blocks.end()) - blocks.begin(), 3) << "blocks of about a pixel";
}

TEST(Layers, DoNotChangeThePicture) {
    BuildOptions options;
    options.integrator = "msaa-cache";
    const Image plain = test::render(test::build(halfWall(), options)).image;
    const Shown shown = show(halfWall(), "msaa-cache");
    EXPECT_EQ(0, std::memcmp(plain.pixels.data(), shown.film.image().pixels.data(),
                             plain.pixels.size() * sizeof(Rgb)));
}

TEST(Heatmap, RunsFromBlueToRed) {
    Film film(200, 4, {0, 0, 200, 4}, {Aov::Shades, Aov::ShadeTime});
    for (int x = 0; x < 200; ++x) {
        film.setLayer(0, x, 0, float(x % 65));
        film.setLayer(1, x, 0, x == 0 ? -1.f : 1.f);
    }
    const Image shades = heatmap(film, Aov::Shades, 64);
    EXPECT_EQ(shades.width, 200);
    EXPECT_GT(shades.height, 20) << "no scale";
    EXPECT_EQ(shades.at(0, 0), Rgb(0)) << "no shade";
    EXPECT_GT(shades.at(1, 0).z, 4 * shades.at(1, 0).x) << "one shade: blue";
    EXPECT_GT(shades.at(64, 0).x, 4 * shades.at(64, 0).z) << "all shades: red";
    const Image time = heatmap(film, Aov::ShadeTime, 64);
    EXPECT_EQ(time.at(0, 0), Rgb(0)) << "absent";
    EXPECT_GT(time.at(1, 0).x, 4 * time.at(1, 0).z);
}

TEST(ShadeCost, EstimatesMeanAndDeviation) {
    // Packets of 1 and 4 from costs 2 ± 1: the deviation is of one shade, not of a packet.
    ShadeCost cost;
    uint32_t state = 1;
    const auto next = [&] { return (state = state * 1664525u + 1013904223u) >> 31 ? 3.0 : 1.0; };
    for (int i = 0; i < 4000; ++i) {
        const int n = i % 2 ? 4 : 1;
        double seconds = 0;
        for (int k = 0; k < n; ++k)
            seconds += next();
        cost.add(uint64_t(n), seconds);
    }
    EXPECT_EQ(cost.shades(), 10000u);
    EXPECT_NEAR(cost.mean(), 2, 0.05);
    EXPECT_NEAR(cost.deviation(), 1, 0.05);
}

TEST(ShadeCost, IsMeasuredPerMaterial) {
    BuildOptions options;
    const auto rendered = test::render(test::build(halfWall(), options), 0, 1, 8); // several batches
    const auto& costs = rendered.stats.total.shadeCosts;
    ASSERT_GE(costs.size(), 2u);
    uint64_t shades = 0;
    for (const ShadeCost& cost : costs)
        shades += cost.shades();
    EXPECT_GT(shades, 0u);
    EXPECT_LE(shades, rendered.stats.total.shades + rendered.stats.total.missed);
}

} // namespace
} // namespace strobe
