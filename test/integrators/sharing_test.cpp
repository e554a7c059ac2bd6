// msaa and msaa-cache against supersample.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

// Texture, moving shadow, curved and flat meshes, a quadric, a lens, and a filter with negative lobes.
std::string scene(const std::string& sampler = "\"sobol\" \"integer pixelsamples\" 16") {
    return "Film \"image\" \"integer xresolution\" 40 \"integer yresolution\" 30\nPixelFilter "
           "\"mitchell\"\nSampler " +
           sampler +
           "\nIntegrator \"directlighting\"\nLookAt 0 2 -6 0 .5 0 0 1 0\n"
           "Camera \"perspective\" \"float fov\" 50 \"float lensradius\" .03 \"float focaldistance\" "
           "6\nWorldBegin\n"
           "LightSource \"infinite\" \"rgb L\" [.3 .4 .5]\n"
           "AttributeBegin\nTranslate 2 4 -2\nAreaLightSource \"diffuse\" \"rgb L\" [20 20 20]\nShape "
           "\"sphere\" \"float radius\" .5\nAttributeEnd\n"
           "Texture \"c\" \"rgb\" \"checkerboard\" \"rgb tex1\" [.2 .2 .2] \"rgb tex2\" [.9 .8 .7]\n"
           "Material \"matte\" \"texture Kd\" \"c\"\n"
           "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 "
           "9] \"point2 uv\" [0 0 8 0 8 8 0 8]\n"
           "AttributeBegin\nMaterial \"plastic\" \"float roughness\" .1\nTranslate -1 1 0\nActiveTransform "
           "EndTime\n"
           "Translate .5 0 0\nRotate 60 0 0 1\nActiveTransform All\nShape \"sphere\" \"float radius\" "
           ".7\nAttributeEnd\n"
           "AttributeBegin\nMaterial \"matte\"\nTranslate 1.2 1 -1\nActiveTransform EndTime\nTranslate 0 .4 "
           "0\nActiveTransform All\nScale .7 .7 .7\n"
           "Shape \"loopsubdiv\" \"integer nlevels\" 3 \"integer indices\" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 "
           "5  1 2 5  3 1 5  0 3 5] "
           "\"point P\" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1.5  0 0 -1.5]\nAttributeEnd\n";
}

BuiltScene build(const std::string& text, const std::string& integrator,
                 std::vector<std::string> defines = {}) {
    BuildOptions options;
    options.integrator = integrator;
    options.defines = std::move(defines);
    return test::build(text, options);
}

bool sameBits(const Image& a, const Image& b) {
    return !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

TEST(Msaa, IsUnbiased) {
    constexpr int kSeeds = 64;
    for (const char* shades : {"shades=1", "shades=3"}) {
        const auto truth = test::renderSeeds(build(scene(), "supersample"), kSeeds, 100);
        const auto shared = test::renderSeeds(build(scene(), "msaa", {shades}), kSeeds, 900);
        const double z = test::criticalZ(truth.mean.size(), kSeeds);
        for (size_t i = 0; i < truth.mean.size(); ++i)
            EXPECT_NEAR(shared.mean[i], truth.mean[i], z * std::hypot(shared.error[i], truth.error[i]) + 1e-5)
                << i;
    }
}

TEST(Msaa, ManyShadesIsSupersample) {
    const Image a = test::render(build(scene(), "supersample")).image;
    const Image b = test::render(build(scene(), "msaa", {"shades=1"})).image;
    EXPECT_FALSE(sameBits(a, b));
    // Every sample of a group is shaded: the same values, summed in another order.
    const Image c = test::render(build(scene(), "msaa", {"shades=16"})).image;
    for (size_t p = 0; p < a.pixels.size(); ++p)
        EXPECT_NEAR(a.pixels[p].x, c.pixels[p].x, 1e-5f * (1 + a.pixels[p].x));
}

TEST(MsaaCache, BlockSizeZeroIsSupersample) {
    EXPECT_TRUE(sameBits(test::render(build(scene(), "supersample")).image,
                         test::render(build(scene(), "msaa-cache", {"blocksize=0"})).image));
}

TEST(MsaaCache, SameBitsForAnyCacheThreadsAndTiles) {
    // Small blocks are more than a thread remembers: the cache has them.
    for (const char* extra : {"timebins=1", "timebins=4", "interpolate=nearest", "blocksize=0.25"}) {
        const BuiltScene built = build(scene(), "msaa-cache", {"shades=2", extra});
        const auto reference = test::render(built, 3, 1, 16);
        EXPECT_EQ(reference.stats.total.cacheHits > 0, extra == std::string("blocksize=0.25"));
        for (int threads : {2, 7})
            EXPECT_TRUE(sameBits(reference.image, test::render(built, 3, threads, 8).image))
                << extra << threads;
        for (const char* size : {"cache-mb=0", "cache-mb=0.001", "cache-mb=1024"}) {
            const BuiltScene other = build(scene(), "msaa-cache", {"shades=2", extra, size});
            EXPECT_TRUE(sameBits(reference.image, test::render(other, 3, 2, 64).image))
                << extra << ' ' << size;
        }
        BuildOptions options;
        options.integrator = "msaa-cache";
        options.defines = {"shades=2", extra};
        options.crop = {.25f, .75f, .2f, .9f};
        const BuiltScene cropped = test::build(scene(), options);
        const Image part = test::render(cropped, 3).image;
        for (int y = cropped.pixelBounds.y0; y < cropped.pixelBounds.y1; ++y)
            EXPECT_EQ(0, std::memcmp(&part.at(0, y - cropped.pixelBounds.y0),
                                     &reference.image.at(cropped.pixelBounds.x0, y),
                                     sizeof(Rgb) * size_t(part.width)));
    }
}

TEST(MsaaCache, FurnaceStaysOne) {
    for (const char* blocks : {"blocksize=0.25", "blocksize=1", "blocksize=4", "blocksize=64"}) {
        const BuiltScene built = build(
            "Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 12\n"
            "Sampler \"sobol\" \"integer pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 200\n"
            "Camera \"perspective\" \"float fov\" 90\nWorldBegin\nReverseOrientation\n"
            "AreaLightSource \"diffuse\" \"rgb L\" [.5 .5 .5]\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
            "Translate .3 .2 0\nShape \"sphere\" \"float radius\" 1\n",
            "msaa-cache", {blocks, "shades=4"});
        double sum = 0, sum2 = 0;
        constexpr int kSeeds = 32;
        for (uint64_t seed = 0; seed < kSeeds; ++seed) {
            double mean = 0;
            for (const Rgb& p : test::render(built, seed).image.pixels)
                mean += p.x / 144.0;
            sum += mean, sum2 += mean * mean;
        }
        const double mean = sum / kSeeds,
                     error = std::sqrt(std::max(0.0, sum2 / kSeeds - mean * mean) / (kSeeds - 1));
        EXPECT_NEAR(mean, 1, test::criticalZ(1, kSeeds) * error) << blocks;
    }
}

TEST(MsaaCache, BiasFallsWithTheBlock) {
    // Mean over seeds against supersample: the mean absolute error over pixels, beyond what noise explains.
    constexpr int kSeeds = 48;
    const auto truth = test::renderSeeds(build(scene(), "supersample"), kSeeds, 100);
    double last = kInfinity;
    for (const char* blocks : {"blocksize=4", "blocksize=1", "blocksize=0.25"}) {
        const auto shared =
            test::renderSeeds(build(scene(), "msaa-cache", {blocks, "shades=4"}), kSeeds, 900);
        double bias2 = 0;
        for (size_t i = 0; i < truth.mean.size(); ++i) {
            const double d = shared.mean[i] - truth.mean[i];
            bias2 += d * d - shared.error[i] * shared.error[i] - truth.error[i] * truth.error[i];
        }
        bias2 /= double(truth.mean.size());
        EXPECT_LT(bias2, last) << blocks;
        last = bias2;
    }
    EXPECT_LT(std::sqrt(std::max(last, 0.0)), 0.02);
}

TEST(MsaaCache, ShadesLessUnderMotion) {
    const auto super = test::render(build(scene(), "supersample")),
               shared = test::render(build(scene(), "msaa-cache"));
    EXPECT_LT(shared.stats.total.shades, super.stats.total.shades / 2);
}

} // namespace
} // namespace strobe
