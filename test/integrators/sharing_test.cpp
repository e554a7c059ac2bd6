// msaa and msaa-cache against supersample.
#include "integrators/sharing_support.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::buildWith;
using test::haveEqualBits;

/// A texture, a moving shadow, curved and flat meshes, a quadric, a lens, and a filter with negative lobes.
const std::string kScene = R"(
Film "image" "integer xresolution" 40 "integer yresolution" 30
PixelFilter "mitchell"
Sampler "sobol" "integer pixelsamples" 16
Integrator "directlighting"
LookAt 0 2 -6  0 .5 0  0 1 0
Camera "perspective" "float fov" 50 "float lensradius" .03 "float focaldistance" 6
WorldBegin
LightSource "infinite" "rgb L" [.3 .4 .5]
AttributeBegin
  Translate 2 4 -2
  AreaLightSource "diffuse" "rgb L" [20 20 20]
  Shape "sphere" "float radius" .5
AttributeEnd
Texture "c" "rgb" "checkerboard" "rgb tex1" [.2 .2 .2] "rgb tex2" [.9 .8 .7]
Material "matte" "texture Kd" "c"
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2]
  "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9] "point2 uv" [0 0 8 0 8 8 0 8]
AttributeBegin
  Material "plastic" "float roughness" .1
  Translate -1 1 0
  ActiveTransform EndTime
  Translate .5 0 0
  Rotate 60 0 0 1
  ActiveTransform All
  Shape "sphere" "float radius" .7
AttributeEnd
AttributeBegin
  Material "matte"
  Translate 1.2 1 -1
  ActiveTransform EndTime
  Translate 0 .4 0
  ActiveTransform All
  Scale .7 .7 .7
  Shape "loopsubdiv" "integer nlevels" 3
    "integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]
    "point P" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1.5  0 0 -1.5]
AttributeEnd
)";

TEST(Msaa, IsUnbiased) {
    constexpr int kSeeds = 64;
    const auto reference = test::renderSeeds(buildWith("supersample", kScene), kSeeds, 100);
    const double z = test::criticalZ(reference.mean.size(), kSeeds);
    for (const char* shades : {"shades=1", "shades=3"}) {
        const auto shared = test::renderSeeds(buildWith("msaa", kScene, {shades}), kSeeds, 900);
        for (size_t i = 0; i < reference.mean.size(); ++i)
            EXPECT_NEAR(shared.mean[i], reference.mean[i],
                        z * std::hypot(shared.error[i], reference.error[i]) + 1e-5)
                << i;
    }
}

TEST(Msaa, WithAShadePerSampleIsSupersample) {
    const Image reference = test::render(buildWith("supersample", kScene)).image;
    EXPECT_FALSE(haveEqualBits(reference, test::render(buildWith("msaa", kScene, {"shades=1"})).image));
    // Each sample of a group is shaded; the same values are summed in another order.
    const Image image = test::render(buildWith("msaa", kScene, {"shades=16"})).image;
    for (size_t p = 0; p < image.pixels.size(); ++p)
        EXPECT_NEAR(reference.pixels[p].x, image.pixels[p].x, 1e-5f * (1 + reference.pixels[p].x));
}

TEST(MsaaCache, WithBlockSizeZeroIsSupersample) {
    EXPECT_TRUE(haveEqualBits(test::render(buildWith("supersample", kScene)).image,
                              test::render(buildWith("msaa-cache", kScene, {"blocksize=0"})).image));
}

TEST(MsaaCache, BitsDoNotDependOnCacheSizeThreadsTilesOrCrop) {
    for (const char* define : {"timebins=1", "timebins=4", "interpolate=nearest", "blocksize=0.25"}) {
        const BuiltScene built = buildWith("msaa-cache", kScene, {"shades=2", define});
        const auto reference = test::render(built, 3, 1, 16);
        // Small blocks exceed InterpolationTable: only these are looked up in the cache again.
        EXPECT_EQ(reference.stats.total.cacheHits > 0, define == std::string("blocksize=0.25"));
        for (int threads : {2, 7})
            EXPECT_TRUE(haveEqualBits(reference.image, test::render(built, 3, threads, 8).image))
                << define << threads;
        for (const char* size : {"cache-mb=0", "cache-mb=0.001", "cache-mb=1024"}) {
            const BuiltScene other = buildWith("msaa-cache", kScene, {"shades=2", define, size});
            EXPECT_TRUE(haveEqualBits(reference.image, test::render(other, 3, 2, 64).image))
                << define << ' ' << size;
        }
        BuildOptions options;
        options.integrator = "msaa-cache";
        options.defines = {"shades=2", define};
        options.crop = {.25f, .75f, .2f, .9f};
        const BuiltScene cropped = test::build(kScene, options);
        EXPECT_TRUE(test::isCropOf(test::render(cropped, 3).image, reference.image, cropped.pixelBounds.x0,
                                   cropped.pixelBounds.y0))
            << define;
    }
}

TEST(MsaaCache, FurnaceHasRadianceOne) {
    for (const char* blockSize : {"blocksize=0.25", "blocksize=1", "blocksize=4", "blocksize=64"}) {
        const BuiltScene built = buildWith("msaa-cache", test::kFurnace, {blockSize, "shades=4"});
        const auto [mean, error] = test::meanOverSeeds(built, 32);
        EXPECT_NEAR(mean, 1, test::criticalZ(1, 32) * error) << blockSize;
    }
}

TEST(MsaaCache, BiasFallsWithTheBlockSize) {
    constexpr int kSeeds = 48;
    const auto reference = test::renderSeeds(buildWith("supersample", kScene), kSeeds, 100);
    double lastBias2 = kInfinity;
    for (const char* blockSize : {"blocksize=4", "blocksize=1", "blocksize=0.25"}) {
        const auto shared =
            test::renderSeeds(buildWith("msaa-cache", kScene, {blockSize, "shades=4"}), kSeeds, 900);
        const double bias2 = test::squaredBias(shared, reference);
        EXPECT_LT(bias2, lastBias2) << blockSize;
        lastBias2 = bias2;
    }
    EXPECT_LT(std::sqrt(std::max(lastBias2, 0.0)), 0.02);
}

TEST(MsaaCache, HasFewerShadesUnderMotion) {
    const auto reference = test::render(buildWith("supersample", kScene));
    const auto shared = test::render(buildWith("msaa-cache", kScene));
    EXPECT_LT(shared.stats.total.shades, reference.stats.total.shades / 2);
}

std::string errorOf(std::vector<std::string> defines) {
    try {
        buildWith("msaa-cache", kScene, std::move(defines));
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

TEST(MsaaCache, InvalidParametersAreErrors) {
    EXPECT_EQ(errorOf({"scope=shard"}),
              "unknown scope \"shard\"; did you mean \"shared\"? (known: shared, thread, mutex, tile)");
    EXPECT_EQ(errorOf({"interpolate=linear"}), "unknown interpolate \"linear\" (known: lattice, nearest)");
    EXPECT_EQ(errorOf({"cache-mb=large"}),
              "\"cache-mb\" must be a number, \"auto\" or \"unbounded\", not \"large\"");
    EXPECT_EQ(errorOf({"cache-mb=-1"}), "\"cache-mb\" must not be negative");
}

} // namespace
} // namespace strobe
