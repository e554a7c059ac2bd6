// The errors that adaptive-cache estimates.
#include "core/film/noise.h"
#include "core/render/passes.h"
#include "integrators/sharing_support.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// A corner with a ball that moves, under a lamp that the camera sees.
std::string makeScene(int samples) {
    return test::lampFrame(64, 48, samples, "path") + R"(
Material "matte" "rgb Kd" [.8 .7 .5]
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 0 2  9 0 2  9 9 2  -9 9 2]
Translate -1.2 1 0
ActiveTransform EndTime
Translate .5 0 0
ActiveTransform All
Shape "sphere" "float radius" .7
)";
}

struct NoiseRender {
    Image image;
    RenderStats stats;
    std::vector<int> finished; ///< the passes after which the film was finished
};

NoiseRender renderUntil(double noise, const std::string& integrator, const std::vector<std::string>& defines,
                        uint64_t seed, int threads = 2) {
    const BuiltScene built = test::buildWith(integrator, makeScene(4), defines);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    settings.threads = threads;
    PassGoal goal;
    goal.noise = noise;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    NoiseRender out;
    out.stats =
        renderPasses(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                     settings, goal, 1, film, [&](const Film&, const RenderStats& stats) {
                         out.finished.push_back(stats.passes);
                         return std::nullopt;
                     });
    out.image = film.image();
    return out;
}

/// Whether the light of all parts is shared or that of one, with a fraction of the samples of supersample.
TEST(AdaptiveCacheNoise, TargetsAreMet) {
    constexpr double kTarget = 0.1;
    const Image reference = test::render(test::buildWith("supersample", makeScene(2048)), 99).image;
    const uint64_t own = renderUntil(kTarget, "supersample", {}, 1).stats.total.visibilitySamples;
    for (const char* const share : {"share=both", "share=indirect"}) {
        size_t covered = 0, pixels = 0;
        uint64_t samples = 0;
        constexpr uint64_t kSeeds = 4;
        for (uint64_t seed = 0; seed < kSeeds; ++seed) {
            const NoiseRender result = renderUntil(kTarget, "adaptive-cache", {share}, seed);
            EXPECT_LE(*result.stats.noise, kTarget);
            samples += result.stats.total.visibilitySamples;
            for (size_t i = 0; i < reference.pixels.size(); ++i, ++pixels) {
                const double expected = luminance(reference.pixels[i]);
                covered += std::abs(luminance(result.image.pixels[i]) - expected) <=
                           kTarget * std::max<double>(expected, NoiseEstimate::kFloor);
            }
        }
        EXPECT_GE(double(covered) / double(pixels), NoiseEstimate::kPixelFraction) << share;
        EXPECT_LT(3 * samples, kSeeds * own) << share;
    }
}

/// Which passes are finished decides about their number, and does not depend on the time.
TEST(AdaptiveCacheNoise, PassesDoNotDependOnThreads) {
    const NoiseRender one = renderUntil(0.03, "adaptive-cache", {"share=both"}, 5, 1),
                      three = renderUntil(0.03, "adaptive-cache", {"share=both"}, 5, 3);
    EXPECT_TRUE(test::haveEqualBits(one.image, three.image));
    EXPECT_EQ(one.finished, three.finished);
    EXPECT_LT(2 * int(one.finished.size()), one.stats.passes);
}

} // namespace
} // namespace strobe
