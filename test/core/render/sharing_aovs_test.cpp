// The AOVs of AovGroup::Sharing, compared with what each integrator shades.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

const std::vector<Aov> kAll = {Aov::Shades, Aov::Samples, Aov::HitRate, Aov::Cell, Aov::ShadeTime};

/// The left half of the frame is a wall, the right half is background.
const std::string kHalfWall = R"(
    Film "image" "integer xresolution" 16 "integer yresolution" 8
    Sampler "sobol" "integer pixelsamples" 16
    Integrator "directlighting"
    Camera "orthographic" "float screenwindow" [-2 2 -1 1]
    WorldBegin
    LightSource "infinite"
    Material "matte"
    Shape "trianglemesh" "integer indices" [0 1 2] "point P" [0 -9 5  0 9 5  -99 0 5]
)";

struct FilmAndStats {
    Film film;
    RenderStats stats;
};

FilmAndStats renderLayers(const std::string& integrator, int threads = 1, int tile = 64) {
    BuildOptions options;
    options.integrator = integrator;
    const BuiltScene built = test::build(kHalfWall, options);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.threads = threads;
    settings.tileSize = tile;
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

TEST(SharingAovs, SupersampleShadesEachHit) {
    const Film film = renderLayers("supersample").film;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) {
            const size_t i = size_t(y * 16 + x);
            const bool wall = x < 8;
            EXPECT_EQ(film.plane(Aov::Shades)[i], wall ? 16 : 0);
            EXPECT_EQ(film.plane(Aov::Samples)[i], 16);
            EXPECT_EQ(film.plane(Aov::HitRate)[i], 0);
            EXPECT_EQ(film.plane(Aov::Cell)[i], 0);
            if (wall)
                EXPECT_NEAR(film.plane(Aov::ShadeTime)[i], 0.5, 1. / 32); // the times are stratified
            else
                EXPECT_EQ(film.plane(Aov::ShadeTime)[i], -1);
        }
}

TEST(SharingAovs, MsaaShadesOncePerPixelAndPrimitive) {
    const Film film = renderLayers("msaa").film;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
            EXPECT_EQ(film.plane(Aov::Shades)[size_t(y * 16 + x)], 1);
            EXPECT_FLOAT_EQ(film.plane(Aov::HitRate)[size_t(y * 16 + x)], 15.f / 16);
        }
}

TEST(SharingAovs, ShadesAddUpToTheCounter) {
    for (const char* integrator : {"supersample", "msaa", "msaa-cache"})
        for (int threads : {1, 3}) {
            const FilmAndStats rendered = renderLayers(integrator, threads, 4);
            EXPECT_EQ(sum(rendered.film.plane(Aov::Shades)), double(rendered.stats.total.shades))
                << integrator;
        }
}

TEST(SharingAovs, CellsIdentifySharedShades) {
    const Film film = renderLayers("msaa-cache").film;
    std::vector<float> cells(film.plane(Aov::Cell).begin(), film.plane(Aov::Cell).begin() + 8);
    for (float cell : cells)
        EXPECT_GT(cell, 0);
    std::sort(cells.begin(), cells.end());
    EXPECT_GT(std::unique(cells.begin(), cells.end()) - cells.begin(), 3) << "cells of about a pixel";
}

TEST(SharingAovs, DoNotChangeTheImage) {
    BuildOptions options;
    options.integrator = "msaa-cache";
    const Image plain = test::render(test::build(kHalfWall, options)).image;
    const FilmAndStats rendered = renderLayers("msaa-cache");
    EXPECT_EQ(0, std::memcmp(plain.pixels.data(), rendered.film.image().pixels.data(),
                             plain.pixels.size() * sizeof(Rgb)));
}

} // namespace
} // namespace strobe
