// More samples where noise is.
#include "core/render/render.h"
#include "support/fence_scene.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <numeric>
#include <unistd.h>

namespace strobe {
namespace {

const std::string kLamp = R"(
AttributeBegin
AreaLightSource "diffuse" "rgb L" [2 2 2] "bool twosided" true
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1.75 -.25 4  -1.25 -.25 4  -1.25 .25 4  -1.75 .25 4]
AttributeEnd
)";

BuiltScene buildScene(const std::string& integrator, const std::string& scene) {
    BuildOptions options;
    options.integrator = integrator;
    return test::build(scene, options);
}

BuiltScene buildScene(const std::string& integrator, int samples) {
    return buildScene(integrator, test::fenceScene(samples));
}

RenderSettings settingsFor(const BuiltScene& built, uint64_t seed = 0) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    return settings;
}

Film renderFilm(const BuiltScene& built, const RenderSettings& settings) {
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds, {Aov::Samples});
    render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter, settings,
           film);
    return film;
}

TEST(SamplePlan, TakesMoreSamplesWhereNoiseIs) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    const Film film = renderFilm(built, settingsFor(built));
    const std::vector<float>& samples = film.plane(Aov::Samples);
    EXPECT_EQ(samples[8], 16);
    EXPECT_GE(samples[68], 32);
}

/// Few pairs are measured: one half of them alone would not promise a gain.
TEST(SamplePlan, RendersOfFewSamplesAdapt) {
    for (const int samples : {4, 8}) {
        const BuiltScene built = buildScene("adaptive-cache", samples);
        const Film film = renderFilm(built, settingsFor(built));
        EXPECT_EQ(film.plane(Aov::Samples)[8], samples);
        EXPECT_GE(film.plane(Aov::Samples)[68], 2 * samples);
    }
}

/// The map of an infinite light with vertical stripes, in a file.
class StripedMap {
  public:
    StripedMap() {
        std::ofstream out(m_path, std::ios::binary);
        out << "P3\n64 1\n255\n";
        for (int i = 0; i < 64; ++i)
            out << (i % 2 ? "200 200 200 " : "100 100 100 ");
    }
    ~StripedMap() { std::remove(m_path.c_str()); }
    StripedMap(const StripedMap&) = delete;
    StripedMap& operator=(const StripedMap&) = delete;
    std::string parameter() const { return "\"string mapname\" \"" + m_path + "\""; }

  private:
    const std::string m_path = testing::TempDir() + "strobe_stripes_" + std::to_string(getpid()) + ".ppm";
};

/// Returns the number of samples of a pixel of the background of a quad from x = -9 to `right` (the left edge
/// of the image is at -1.6), all of whose light is shared.
float samplesOfBackground(const std::string& mapParameter, const std::string& right, int samples) {
    BuildOptions options;
    options.integrator = "adaptive-cache";
    options.defines = {"share=both"};
    const std::string points = "[-9 -9 0  " + right + " -9 0  " + right + " 9 0  -9 9 0]";
    const BuiltScene built = test::build(R"(
Film "image" "integer xresolution" 64 "integer yresolution" 32
Sampler "sobol" "integer pixelsamples" )" + std::to_string(samples) +
                                             R"(
Integrator "directlighting"
LookAt 0 0 -3  0 0 0  0 1 0
Camera "perspective" "float fov" 30
WorldBegin
LightSource "infinite" )" + mapParameter +
                                             R"(
Material "matte"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" )" +
                                             points,
                                         options);
    return renderFilm(built, settingsFor(built)).plane(Aov::Samples)[16 * 64 + 56];
}

/// A background cannot gain by sharing: it has as many more samples as the render takes more time, if it has
/// noise.
TEST(SamplePlan, NoisyBackgroundsKeepUpWithTheTime) {
    const StripedMap map;
    EXPECT_EQ(samplesOfBackground("", "0", 16), 16);
    EXPECT_GE(samplesOfBackground(map.parameter(), "0", 16), 32);
}

/// In an image that is mostly background, it would have to keep up with itself: with 64 and 128 samples here.
TEST(SamplePlan, BackgroundsAddALimitedTime) {
    const StripedMap map;
    for (const int samples : {4, 16}) {
        const float ofBackground = samplesOfBackground(map.parameter(), "-1.4", samples);
        EXPECT_GE(ofBackground, 2 * samples);
        EXPECT_LE(ofBackground, samples == 4 ? 32 : 64);
    }
}

/// Returns the numbers of samples of the pixels of a floor with even noise.
std::vector<float> samplesOfEvenNoise(int samples) {
    const StripedMap map;
    const std::string world = "LightSource \"infinite\" " + map.parameter() + R"(
Material "matte"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]
)";
    const BuiltScene built = buildScene("adaptive-cache", test::frontView(samples, world));
    return renderFilm(built, settingsFor(built)).plane(Aov::Samples);
}

/// The noise of the pilot does not look like a gain.
TEST(SamplePlan, EvenNoiseHasEqualSamples) {
    for (const int samples : {16, 32})
        for (const float count : samplesOfEvenNoise(samples))
            ASSERT_EQ(count, samples);
}

/// With few samples, sharing takes longer than they do, so that more of them are worth their time: at most
/// three times as many.
TEST(SamplePlan, FewSamplesBecomeMoreWhereSharingTakesLong) {
    for (const int samples : {2, 4, 8}) {
        const std::vector<float> counts = samplesOfEvenNoise(samples);
        const float mean = std::accumulate(counts.begin(), counts.end(), 0.f) / float(counts.size());
        EXPECT_GE(mean, 1.5f * float(samples));
        EXPECT_LE(mean, 3 * float(samples));
    }
}

/// The edges of lamps are EmissionRefinement's task: they do not hide other noise.
TEST(SamplePlan, LampsDoNotHideOtherNoise) {
    constexpr int kBars = 14;
    for (const bool hasLamp : {false, true}) {
        const BuiltScene built =
            buildScene("adaptive-cache", test::fenceScene(16, kBars, hasLamp ? kLamp : ""));
        const Film film = renderFilm(built, settingsFor(built));
        EXPECT_EQ(film.plane(Aov::Samples)[8], 16);
        EXPECT_GE(film.plane(Aov::Samples)[68], 32) << hasLamp;
    }
}

TEST(SamplePlan, DoesNotDependOnTheSeed) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    EXPECT_EQ(renderFilm(built, settingsFor(built, 1)).plane(Aov::Samples),
              renderFilm(built, settingsFor(built, 2)).plane(Aov::Samples));
}

/// The samples of a pixel are those of a render with as many samples per pixel.
TEST(SamplePlan, PixelsEqualThoseOfARenderWithTheirNumberOfSamples) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    const Film film = renderFilm(built, settingsFor(built));
    ASSERT_TRUE(film.records().note().starts_with("shares no light, more samples")) << film.records().note();
    std::map<float, Image> images;
    for (size_t i = 0; i < film.image().pixels.size(); ++i) {
        const float samples = film.plane(Aov::Samples)[i];
        if (!images.contains(samples)) {
            const BuiltScene uniform = buildScene("supersample", int(samples));
            images[samples] = renderFilm(uniform, settingsFor(uniform)).image();
        }
        ASSERT_EQ(film.image().pixels[i].x, images[samples].pixels[i].x) << i << ", " << samples;
    }
    EXPECT_GE(images.size(), 2u);
}

/// Nothing is shared on an evenly lit floor: a slice traces the samples of its pixels, but shades its own.
TEST(SamplePlan, SlicesShadeTheirOwnSamples) {
    const BuiltScene built = buildScene("adaptive-cache", test::fenceScene(16, 0));
    RenderSettings settings = settingsFor(built);
    settings.slice = SampleSlice{0, 4};
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    film.enableAccumulation();
    const RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                                     *built.filter, settings, film);
    EXPECT_EQ(stats.integratorNote, "shares no light: equals supersample");
    EXPECT_EQ(stats.total.shades, 4u * 128 * 64);
}

TEST(SamplePlan, SlicesAddUpToTheWhole) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    film.enableAccumulation();
    for (const SampleSlice slice : {SampleSlice{0, 3}, {3, 11}, {11, 16}}) {
        RenderSettings settings = settingsFor(built);
        settings.slice = slice;
        settings.tileSize = 5 + int(slice.first);
        render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
               settings, film);
    }
    const Image whole = renderFilm(built, settingsFor(built)).image();
    for (size_t i = 0; i < whole.pixels.size(); ++i)
        ASSERT_EQ(film.image().pixels[i].x, whole.pixels[i].x) << i;
}

/// z-test of the sum of the image against supersample.
TEST(SamplePlan, IsUnbiased) {
    const auto sums = [](const char* integrator) {
        const BuiltScene built = buildScene(integrator, 16);
        double sum = 0, squares = 0;
        constexpr int kSeeds = 32;
        for (uint64_t seed = 0; seed < kSeeds; ++seed) {
            const Film film = renderFilm(built, settingsFor(built, seed));
            double total = 0;
            for (const Rgb& pixel : film.image().pixels)
                total += double(pixel.x);
            sum += total / kSeeds;
            squares += total * total / kSeeds;
        }
        return std::pair(sum, (squares - sum * sum) / (kSeeds - 1));
    };
    const auto [adaptive, adaptiveVariance] = sums("adaptive-cache");
    const auto [plain, plainVariance] = sums("supersample");
    EXPECT_LT(adaptiveVariance, plainVariance);
    EXPECT_LT(std::abs(adaptive - plain), 4 * std::sqrt(adaptiveVariance + plainVariance));
}

TEST(SampleFactors, AreThoseOfBlocks) {
    SampleFactors factors({2, 3, 12, 9}, 4);
    EXPECT_EQ(factors.columns(), 3);
    EXPECT_EQ(factors.rows(), 2);
    factors.factors() = {1, 2, 4, 8, 1, 1};
    EXPECT_EQ(factors.at(2, 3), 1u);
    EXPECT_EQ(factors.at(6, 6), 2u);
    EXPECT_EQ(factors.at(5, 7), 8u);
    EXPECT_EQ(factors.at(11, 8), 1u);
    EXPECT_EQ(factors.at(1, 3), 1u) << "outside";
    EXPECT_EQ(factors.in({2, 3, 12, 9}), (std::vector<uint32_t>{1, 2, 4, 8}));
    EXPECT_EQ(factors.in({6, 6, 8, 7}), (std::vector<uint32_t>{2}));
}

} // namespace
} // namespace strobe
