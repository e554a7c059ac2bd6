// msaa-cache with the paper's scopes: blocks that the first rays shade.
#include "integrators/sharing_support.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::buildWith;

const char* const kScopes[] = {"scope=thread", "scope=mutex", "scope=tile"};

/// A floor with a gradient of light, and a moving sphere.
std::string makeScene(int samplesPerPixel = 16) {
    return R"(
Film "image" "integer xresolution" 48 "integer yresolution" 32
Sampler "sobol" "integer pixelsamples" )" +
           std::to_string(samplesPerPixel) + R"(
Integrator "directlighting"
LookAt 0 2 -6  0 .5 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "point" "rgb I" [20 20 20] "point from" [1 3 -1]
Material "matte"
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
Translate -1 1 0
ActiveTransform EndTime
Translate 1 0 0
ActiveTransform All
Shape "sphere" "float radius" .7
)";
}

BuiltScene build(std::vector<std::string> defines, int samplesPerPixel = 16) {
    return buildWith("msaa-cache", makeScene(samplesPerPixel), std::move(defines));
}

double rootMeanSquareError(const Image& image, const Image& reference) {
    double sum = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
        const Rgb &a = image.pixels[i], &b = reference.pixels[i];
        sum += length2(V3f(a.x - b.x, a.y - b.y, a.z - b.z));
    }
    return std::sqrt(sum / double(3 * image.pixels.size()));
}

TEST(FirstRay, BlocksHaveTheRequestedNumberOfShades) {
    for (const char* scope : kScopes) {
        const auto one = test::render(build({scope, "shades=1"}), 0, 1, 1024).stats.total;
        const auto three = test::render(build({scope, "shades=3"}), 0, 1, 1024).stats.total;
        EXPECT_EQ(one.shades, one.cacheLookups - one.cacheHits) << scope;
        EXPECT_GT(three.shades, 2 * one.shades) << scope; // some blocks are hit less than three times
        EXPECT_LE(three.shades, 3 * one.shades) << scope;
        EXPECT_LT(one.shades, one.visibilitySamples / 4) << scope;
    }
}

TEST(FirstRay, ErrorFallsWithTheBlockSize) {
    const Image reference = test::render(buildWith("supersample", makeScene(256)), 99).image;
    for (const char* scope : kScopes)
        for (const char* interpolate : {"interpolate=lattice", "interpolate=nearest"}) {
            const auto errorOf = [&](const char* blockSize) {
                return rootMeanSquareError(test::render(build({scope, interpolate, blockSize}, 64)).image,
                                           reference);
            };
            const double coarse = errorOf("blocksize=8"), fine = errorOf("blocksize=.25");
            EXPECT_LT(fine, coarse) << scope << interpolate;
            EXPECT_LT(fine, 0.05) << scope << interpolate;
        }
}

TEST(FirstRay, ScopesDifferInRepeatedShades) {
    const auto countShades = [&](const char* scope, int threads, int tile) {
        return test::render(build({scope}), 0, threads, tile).stats.total.shades;
    };
    // With one thread, all scopes are equal if there is one tile; smaller tiles repeat shades with scope
    // tile.
    EXPECT_EQ(countShades("scope=thread", 1, 1024), countShades("scope=mutex", 1, 1024));
    EXPECT_EQ(countShades("scope=thread", 1, 1024), countShades("scope=tile", 1, 1024));
    EXPECT_GT(countShades("scope=tile", 1, 4), countShades("scope=thread", 1, 4));
    // With the mutex, threads do not repeat shades.
    EXPECT_LT(double(countShades("scope=mutex", 4, 4)), 1.05 * double(countShades("scope=mutex", 1, 4)));
}

TEST(FirstRay, ABoundedCacheIsClearedWhenFull) {
    for (const char* scope : kScopes) {
        const auto unbounded = test::render(build({scope, "cache-mb=unbounded"}), 0, 1).stats.total;
        const auto bounded = test::render(build({scope, "cache-mb=.002"}), 0, 1).stats.total;
        EXPECT_EQ(unbounded.cacheEvictions, 0u);
        EXPECT_GT(bounded.cacheEvictions, 0u);
        EXPECT_GT(bounded.shades, unbounded.shades);
        EXPECT_LT(bounded.cacheBytes, unbounded.cacheBytes);
        // It is cleared between batches: the blocks of one batch may exceed the bound.
        EXPECT_LT(bounded.cacheBytes, 2000u + 512 * 80);
    }
}

TEST(FirstRay, FurnaceHasRadianceOne) {
    for (const char* scope : kScopes)
        for (const char* blockSize : {"blocksize=.25", "blocksize=4"}) {
            const BuiltScene built = buildWith("msaa-cache", test::kFurnace, {scope, blockSize});
            const test::Estimate mean = test::meanOverSeeds(built, 32);
            EXPECT_NEAR(mean.mean, 1, test::criticalZ(1, 32) * mean.error) << scope << blockSize;
        }
}

} // namespace
} // namespace strobe
