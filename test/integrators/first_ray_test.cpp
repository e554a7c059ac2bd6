// The paper's own caches: blocks that their first rays decide.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

const char* const kScopes[] = {"scope=thread", "scope=mutex", "scope=tile"};

/// A floor with a gradient of light, and a ball that moves.
std::string scene(int spp = 16) {
    return "Film \"image\" \"integer xresolution\" 48 \"integer yresolution\" 32\nSampler \"sobol\" "
           "\"integer "
           "pixelsamples\" " +
           std::to_string(spp) +
           "\nIntegrator \"directlighting\"\nLookAt 0 2 -6 0 .5 0 0 1 0\nCamera \"perspective\" \"float "
           "fov\" 50\n"
           "WorldBegin\nLightSource \"point\" \"rgb I\" [20 20 20] \"point from\" [1 3 -1]\nMaterial "
           "\"matte\"\n"
           "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 "
           "9]\n"
           "Translate -1 1 0\nActiveTransform EndTime\nTranslate 1 0 0\nActiveTransform All\nShape "
           "\"sphere\" "
           "\"float radius\" .7\n";
}

BuiltScene build(const std::string& text, std::vector<std::string> defines) {
    BuildOptions options;
    options.integrator = "msaa-cache";
    options.defines = std::move(defines);
    return test::build(text, options);
}

double rootMeanSquare(const Image& a, const Image& b) {
    double sum = 0;
    for (size_t i = 0; i < a.pixels.size(); ++i)
        sum += length2(
            V3f(a.pixels[i].x - b.pixels[i].x, a.pixels[i].y - b.pixels[i].y, a.pixels[i].z - b.pixels[i].z));
    return std::sqrt(sum / double(3 * a.pixels.size()));
}

TEST(FirstRay, EveryBlockIsShadedAsOftenAsItSays) {
    // One flat triangle pair, seen by nothing else: blocks are counted by their first shades.
    for (const char* scope : kScopes) {
        const auto once = test::render(build(scene(), {scope, "shades=1"}), 0, 1, 1024);
        const auto thrice = test::render(build(scene(), {scope, "shades=3"}), 0, 1, 1024);
        const Counters &a = once.stats.total, &b = thrice.stats.total;
        EXPECT_EQ(a.shades, a.cacheLookups - a.cacheHits) << scope;
        EXPECT_GT(b.shades, 2 * a.shades) << scope; // not 3: some blocks are met less than three times
        EXPECT_LE(b.shades, 3 * a.shades) << scope;
        EXPECT_LT(a.shades, a.visibilitySamples / 4) << scope;
    }
}

TEST(FirstRay, ComesNearTheTruthAsBlocksShrink) {
    BuildOptions plain;
    plain.integrator = "supersample";
    const Image truth = test::render(test::build(scene(256), plain), 99).image;
    for (const char* scope : kScopes)
        for (const char* interpolate : {"interpolate=lattice", "interpolate=nearest"}) {
            const double coarse = rootMeanSquare(
                test::render(build(scene(64), {scope, interpolate, "blocksize=8"})).image, truth);
            const double fine = rootMeanSquare(
                test::render(build(scene(64), {scope, interpolate, "blocksize=.25"})).image, truth);
            EXPECT_LT(fine, coarse) << scope << interpolate;
            EXPECT_LT(fine, 0.05) << scope << interpolate;
        }
}

TEST(FirstRay, ScopesDifferInWhatTheyShadeAgain) {
    const auto shades = [&](const char* scope, int threads, int tile) {
        return test::render(build(scene(), {scope}), 0, threads, tile).stats.total.shades;
    };
    // One thread: its cache is everybody's, however the picture is cut. A tile's is not.
    EXPECT_EQ(shades("scope=thread", 1, 1024), shades("scope=mutex", 1, 1024));
    EXPECT_EQ(shades("scope=thread", 1, 1024), shades("scope=tile", 1, 1024));
    EXPECT_GT(shades("scope=tile", 1, 4), shades("scope=thread", 1, 4));
    // The mutex keeps threads from shading a block twice.
    EXPECT_LT(double(shades("scope=mutex", 4, 4)), 1.05 * double(shades("scope=mutex", 1, 4)));
}

TEST(FirstRay, ABoundedCacheStartsAgain) {
    for (const char* scope : kScopes) {
        const auto free = test::render(build(scene(), {scope, "cache-mb=unbounded"}), 0, 1).stats.total;
        const auto tight = test::render(build(scene(), {scope, "cache-mb=.002"}), 0, 1).stats.total;
        EXPECT_EQ(free.cacheEvictions, 0u);
        EXPECT_GT(tight.cacheEvictions, 0u);
        EXPECT_GT(tight.shades, free.shades);
        EXPECT_LT(tight.cacheBytes, free.cacheBytes);
        // Between batches: a batch's own blocks may be on top.
        EXPECT_LT(tight.cacheBytes, 2000u + 512 * 80);
    }
}

TEST(FirstRay, FurnaceStaysOne) {
    for (const char* scope : kScopes)
        for (const char* blocks : {"blocksize=.25", "blocksize=4"}) {
            const BuiltScene built = build(
                "Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 12\nSampler \"sobol\" "
                "\"integer "
                "pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 200\nCamera \"perspective\" "
                "\"float "
                "fov\" 90\nWorldBegin\nReverseOrientation\nAreaLightSource \"diffuse\" \"rgb L\" [.5 .5 .5]\n"
                "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\nTranslate .3 .2 0\nShape \"sphere\" \"float "
                "radius\" 1\n",
                {scope, blocks});
            const test::Estimate mean = test::meanOverSeeds(built, 32);
            EXPECT_NEAR(mean.mean, 1, test::criticalZ(1, 32) * mean.error) << scope << blocks;
        }
}

} // namespace
} // namespace strobe
