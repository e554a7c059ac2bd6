// All scenes of the repository and the original scenes of the paper: bits do not depend on threads, tiles or
// crop. The paper's scenes are also compared with images of the reference renderer.
#include "integrators/sharing_support.h"
#include "support/scene_files.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <numeric>
#include <sstream>

namespace strobe {
namespace {

namespace fs = std::filesystem;

using test::haveEqualBits;

class EveryScene : public testing::TestWithParam<fs::path> {};

TEST_P(EveryScene, BitsDoNotDependOnThreadsTilesOrCrop) {
    if (const std::string lack = test::missing(GetParam()); !lack.empty())
        GTEST_SKIP() << lack;
    BuiltScene built = test::buildFile(GetParam(), test::fourthOfSize());
    const test::Rendered reference = test::render(built, 1, 1, 16);
    EXPECT_EQ(reference.stats.total.invalidSamples, 0u);
    EXPECT_GT(reference.stats.total.surfaces, 0u);
    float brightest = 0;
    for (const Rgb& p : reference.image.pixels)
        brightest = std::max(brightest, std::max(p.x, std::max(p.y, p.z)));
    EXPECT_GT(brightest, 0.05f) << "the image is black";

    struct Configuration {
        int threads, tile;
    };
    for (const auto& [threads, tile] :
         {Configuration{2, 8}, Configuration{7, 64}, Configuration{7, 16}, Configuration{2, 256}})
        EXPECT_TRUE(haveEqualBits(reference.image, test::render(built, 1, threads, tile).image))
            << threads << " threads, tiles of " << tile;

    const PixelBounds whole = built.pixelBounds;
    built.pixelBounds = {whole.x0 + whole.width() / 3, whole.y0 + whole.height() / 4,
                         whole.x0 + whole.width() * 2 / 3 + 1, whole.y0 + whole.height() / 2 + 3};
    EXPECT_TRUE(test::isCropOf(test::render(built, 1).image, reference.image, built.pixelBounds.x0 - whole.x0,
                               built.pixelBounds.y0 - whole.y0));
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(test::allScenes()),
                         [](const auto& info) { return test::testName(info.param); });

class PaperScene : public testing::TestWithParam<const char*> {};

TEST_P(PaperScene, SceneFileEqualsThePbrtFile) {
    const fs::path scene = test::kSource / "scenes/paper" / (std::string(GetParam()) + ".scene");
    const fs::path original = test::pbrtFolder() / (std::string(GetParam()) + ".pbrt");
    if (const std::string lack = test::missing(scene); !lack.empty())
        GTEST_SKIP() << lack;
    const BuiltScene a = test::buildFile(scene, {}), b = test::buildFile(original, {});
    EXPECT_EQ(a.resolution, b.resolution);
    EXPECT_EQ(a.sampler.samplesPerPixel, b.sampler.samplesPerPixel);
    EXPECT_EQ(a.scene->lights().size(), b.scene->lights().size());
    EXPECT_TRUE(haveEqualBits(test::render(test::buildFile(scene, test::fourthOfSize()), 3).image,
                              test::render(test::buildFile(original, test::fourthOfSize()), 3).image));
}

/// Sets pixels above 20 in either image, and the pixels around them, to black in both. Coverage of the edge
/// pixels of a visible light of radiance 2000 is noisy, and clamping (as in ../shared/compare) would bias the
/// mean of few samples.
void maskVisibleLights(Image& a, Image& b) {
    std::vector<char> bright(a.pixels.size(), 0);
    for (size_t i = 0; i < a.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            bright[i] |= a.pixels[i][c] > 20 || b.pixels[i][c] > 20;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x)
            for (int k = 0; k < 9; ++k) {
                const int nx = x + k % 3 - 1, ny = y + k / 3 - 1;
                if (nx >= 0 && ny >= 0 && nx < a.width && ny < a.height && bright[size_t(ny) * a.width + nx])
                    a.at(x, y) = b.at(x, y) = Rgb(0);
            }
}

std::array<double, 3> channelMeans(const Image& image) {
    std::array<double, 3> sum{};
    for (const Rgb& p : image.pixels)
        for (int c = 0; c < 3; ++c)
            sum[size_t(c)] += p[c];
    for (double& s : sum)
        s /= double(image.pixels.size());
    return sum;
}

/// Returns the means of 8x8 pixels over all channels, without the remaining pixels at the right and the
/// bottom.
std::vector<double> tileMeans(const Image& image) {
    std::vector<double> means;
    for (int y = 0; y + 8 <= image.height; y += 8)
        for (int x = 0; x + 8 <= image.width; x += 8) {
            double sum = 0;
            for (int i = 0; i < 64; ++i)
                for (int c = 0; c < 3; ++c)
                    sum += image.at(x + i % 8, y + i / 8)[c];
            means.push_back(sum / (64 * 3));
        }
    return means;
}

/// As ../shared/compare measures it.
struct Difference {
    double mean = 0; ///< largest relative difference of the mean of a channel
    double p95 = 0;  ///< 95th percentile of the relative differences of tileMeans
};

Difference compare(const Image& image, const Image& reference) {
    Difference d;
    const auto a = channelMeans(image), b = channelMeans(reference);
    for (size_t c = 0; c < 3; ++c)
        d.mean = std::max(d.mean, std::abs(a[c] - b[c]) / b[c]);
    const std::vector<double> tiles = tileMeans(image), expected = tileMeans(reference);
    const double mean = std::accumulate(expected.begin(), expected.end(), 0.0) / double(expected.size());
    std::vector<double> relative;
    for (size_t i = 0; i < tiles.size(); ++i)
        relative.push_back(std::abs(tiles[i] - expected[i]) / (expected[i] + .02 * mean));
    std::sort(relative.begin(), relative.end());
    d.p95 = relative[size_t(.95 * double(relative.size() - 1))];
    return d;
}

Image crop(const Image& image, const PixelBounds& pixelBounds) {
    Image result{pixelBounds.width(), pixelBounds.height(),
                 std::vector<Rgb>(size_t(pixelBounds.width()) * pixelBounds.height())};
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x)
            result.at(x, y) = image.at(pixelBounds.x0 + x, pixelBounds.y0 + y);
    return result;
}

TEST_P(PaperScene, MatchesTheReference) {
    const std::string name = GetParam();
    const fs::path reference = test::kSource / "../shared/references" / (name + ".exr");
    const fs::path scene = test::pbrtFolder() / (name + "-half.pbrt");
    if (!fs::exists(reference) || !fs::exists(scene))
        GTEST_SKIP() << "the reference images are missing";
    BuildOptions options;
    options.samplesPerPixel = 64;
    if (name == "anim-moving-reflection") { // glossy reflections of the sun in the environment map are noisy
        options.samplesPerPixel = 512;
        options.crop = {.25f, .75f, .25f, .75f};
    }
    const BuiltScene built = test::buildFile(scene, options);
    Image image = test::render(built, 11).image;
    Image expected = readImage(reference, {});
    ASSERT_EQ(expected.width, built.resolution.x);
    ASSERT_EQ(expected.height, built.resolution.y);
    expected = crop(expected, built.pixelBounds);
    maskVisibleLights(image, expected);
    const Difference d = compare(image, expected);
    RecordProperty("mean", std::to_string(d.mean));
    RecordProperty("p95", std::to_string(d.p95));
    EXPECT_LE(d.mean, .002); // .005 is required
    EXPECT_LE(d.p95, .02);
}

INSTANTIATE_TEST_SUITE_P(Scenes, PaperScene, testing::ValuesIn(test::kPaperScenes), [](const auto& info) {
    std::string name = info.param;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
});

TEST(CompareMeasure, DetectsDifferencesAndMasksLights) {
    Image a{32, 32, std::vector<Rgb>(32 * 32, Rgb(1))}, b = a;
    EXPECT_EQ(compare(a, b).mean, 0);
    for (Rgb& p : a.pixels)
        p.y *= 1.01f;
    EXPECT_NEAR(compare(a, b).mean, .01, 1e-6);
    EXPECT_NEAR(compare(a, b).p95, .01 / 3 / 1.02, 1e-6);
    a.at(5, 5) = Rgb(1000);
    maskVisibleLights(a, b);
    EXPECT_EQ(a.at(6, 6), Rgb(0));
    EXPECT_EQ(b.at(4, 5), Rgb(0));
    EXPECT_EQ(b.at(7, 5), Rgb(1));
}

} // namespace
} // namespace strobe
