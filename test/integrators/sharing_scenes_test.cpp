// msaa and msaa-cache on all scenes of the repository.
#include "integrators/sharing_support.h"
#include "support/scene_files.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::haveEqualBits;

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

/// Options for 20 pixels of width and eight samples per pixel.
BuildOptions tinyOptions(const std::filesystem::path& scene) {
    BuildOptions options;
    const V2i size = test::buildFile(scene, options).resolution;
    options.resolution = {20, std::max(1, 20 * size.y / size.x)};
    options.samplesPerPixel = 8;
    return options;
}

TEST_P(SharingScene, MsaaIsUnbiased) {
    constexpr int kSeeds = 64;
    const BuildOptions options = tinyOptions(GetParam());
    const auto reference = test::renderSeeds(build(options, "supersample"), kSeeds, 100);
    const auto shared = test::renderSeeds(build(options, "msaa"), kSeeds, 900);
    const double z = test::criticalZ(reference.mean.size(), kSeeds);
    // The stratified samples of a pixel may hit the same number of times in all seeds but for a few.
    const double unseen = test::unseenProbability(reference.mean.size(), kSeeds * options.samplesPerPixel);
    for (size_t i = 0; i < reference.mean.size(); ++i)
        EXPECT_NEAR(shared.mean[i], reference.mean[i],
                    z * std::hypot(shared.error[i], reference.error[i]) + unseen * reference.mean[i] + 1e-5)
            << "pixel " << i / 3 % size_t(reference.width) << ',' << i / 3 / size_t(reference.width);
}

TEST_P(SharingScene, CacheBitsDoNotDependOnCacheSizeThreadsTilesOrCrop) {
    const BuildOptions options = test::fourthOfSize();
    BuiltScene built = build(options, "msaa-cache", {"cache-mb=16"});
    const test::Rendered reference = test::render(built, 1, 1, 16);
    EXPECT_EQ(reference.stats.total.invalidSamples, 0u);
    struct Configuration {
        int threads, tile;
        const char* cacheSize;
    };
    const Configuration configurations[] = {
        {2, 8, "cache-mb=16"}, {7, 64, "cache-mb=1"}, {2, 256, "cache-mb=1024"}, {7, 16, "cache-mb=0"}};
    for (const auto& [threads, tile, cacheSize] : configurations) {
        const BuiltScene other = build(options, "msaa-cache", {cacheSize});
        EXPECT_TRUE(haveEqualBits(reference.image, test::render(other, 1, threads, tile).image))
            << threads << " threads, tiles of " << tile << ", " << cacheSize;
    }

    const PixelBounds whole = built.pixelBounds;
    built.pixelBounds = {whole.x0 + whole.width() / 3, whole.y0 + whole.height() / 4,
                         whole.x0 + whole.width() * 2 / 3 + 1, whole.y0 + whole.height() / 2 + 3};
    EXPECT_TRUE(test::isCropOf(test::render(built, 1).image, reference.image, built.pixelBounds.x0 - whole.x0,
                               built.pixelBounds.y0 - whole.y0));
}

TEST_P(SharingScene, WithBlockSizeZeroIsSupersample) {
    const BuildOptions options = test::fourthOfSize();
    const Image reference = test::render(build(options, "supersample")).image;
    for (const char* scope : {"scope=shared", "scope=thread", "scope=mutex", "scope=tile"})
        EXPECT_TRUE(haveEqualBits(reference,
                                  test::render(build(options, "msaa-cache", {"blocksize=0", scope})).image))
            << scope;
}

std::vector<std::filesystem::path> sceneFormatFiles() {
    std::vector<std::filesystem::path> scenes = test::allScenes();
    std::erase_if(scenes, [](const auto& file) { return file.extension() != ".scene"; });
    return scenes;
}

INSTANTIATE_TEST_SUITE_P(Scenes, SharingScene, testing::ValuesIn(sceneFormatFiles()),
                         [](const auto& info) { return test::testName(info.param); });

} // namespace
} // namespace strobe
