// msaa and msaa-cache on every scene: what they promise holds beyond a test's own scene.
#include "support/scene_files.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

bool sameBits(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height &&
           !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

class SharingScene : public testing::TestWithParam<std::filesystem::path> {
  protected:
    void SetUp() override {
        if (const std::string lack = test::missing(GetParam()); !lack.empty())
            GTEST_SKIP() << lack;
    }
    BuiltScene build(BuildOptions options, const std::string& integrator,
                     std::vector<std::string> defines = {}) const {
        options.integrator = integrator;
        options.defines = std::move(defines);
        return test::buildFile(GetParam(), options);
    }
};

/// The scene at about twenty pixels' width, eight samples.
BuildOptions tiny(const std::filesystem::path& scene) {
    BuildOptions options;
    const V2i size = test::buildFile(scene, options).resolution;
    options.resolution = {20, std::max(1, 20 * size.y / size.x)};
    options.samplesPerPixel = 8;
    return options;
}

TEST_P(SharingScene, MsaaIsUnbiased) {
    constexpr int kSeeds = 64;
    const BuildOptions options = tiny(GetParam());
    const auto truth = test::renderSeeds(build(options, "supersample"), kSeeds, 100);
    const auto shared = test::renderSeeds(build(options, "msaa"), kSeeds, 900);
    const double z = test::criticalZ(truth.mean.size(), kSeeds);
    for (size_t i = 0; i < truth.mean.size(); ++i)
        EXPECT_NEAR(shared.mean[i], truth.mean[i],
                    z * std::hypot(shared.error[i], truth.error[i]) + 1e-5 * (1 + truth.mean[i]))
            << "pixel " << i / 3 % size_t(truth.width) << ',' << i / 3 / size_t(truth.width);
}

TEST_P(SharingScene, TheCacheNeverShowsHowItWasRendered) {
    const BuildOptions options = test::fourthOfSize();
    BuiltScene built = build(options, "msaa-cache", {"cache-mb=16"});
    const test::Rendered reference = test::render(built, 1, 1, 16);
    EXPECT_EQ(reference.stats.total.invalidSamples, 0u);
    struct How {
        int threads, tile;
        const char* cache;
    };
    for (const How how : {How{2, 8, "cache-mb=16"}, How{7, 64, "cache-mb=1"}, How{2, 256, "cache-mb=1024"},
                          How{7, 16, "cache-mb=0"}})
        EXPECT_TRUE(
            sameBits(reference.image,
                     test::render(build(options, "msaa-cache", {how.cache}), 1, how.threads, how.tile).image))
            << how.threads << " threads, tiles of " << how.tile << ", " << how.cache;

    const PixelBounds whole = built.pixelBounds;
    built.pixelBounds = {whole.x0 + whole.width() / 3, whole.y0 + whole.height() / 4,
                         whole.x0 + whole.width() * 2 / 3 + 1, whole.y0 + whole.height() / 2 + 3};
    const Image part = test::render(built, 1).image;
    for (int y = 0; y < part.height; ++y)
        EXPECT_EQ(0, std::memcmp(&part.at(0, y),
                                 &reference.image.at(built.pixelBounds.x0 - whole.x0,
                                                     y + built.pixelBounds.y0 - whole.y0),
                                 sizeof(Rgb) * size_t(part.width)))
            << "row " << y << " of the crop";
}

TEST_P(SharingScene, BlocksOfNoSizeAreSupersample) {
    const BuildOptions options = test::fourthOfSize();
    const Image truth = test::render(build(options, "supersample")).image;
    for (const char* scope : {"scope=shared", "scope=thread", "scope=mutex", "scope=tile"})
        EXPECT_TRUE(sameBits(truth, test::render(build(options, "msaa-cache", {"blocksize=0", scope})).image))
            << scope;
}

std::vector<std::filesystem::path> ourSpelling() {
    std::vector<std::filesystem::path> scenes = test::allScenes();
    std::erase_if(scenes, [](const auto& file) { return file.extension() != ".scene"; });
    return scenes;
}

INSTANTIATE_TEST_SUITE_P(Scenes, SharingScene, testing::ValuesIn(ourSpelling()),
                         [](const auto& info) { return test::testName(info.param); });

} // namespace
} // namespace strobe
