// Pictures made in passes: they end in time, are uniform, and meet the noise they were asked for.
#include "core/math/hash.h"
#include "core/render/passes.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

using Clock = PassGoal::Clock;
using namespace std::chrono_literals;

/// Motion, a lit and a shadowed floor, edges, a texture.
BuiltScene buildWith(const std::string& integrator, int spp = 8) {
    BuildOptions options;
    options.integrator = integrator;
    options.samplesPerPixel = spp;
    return test::build(
        "TransformTimes 0 1\nFilm \"image\" \"integer xresolution\" 14 \"integer yresolution\" 10\n"
        "Integrator \"directlighting\"\nLookAt 0 2 -6 0 .5 0 0 1 0\nCamera \"perspective\" \"float fov\" 50\n"
        "WorldBegin\nLightSource \"infinite\" \"rgb L\" [.3 .4 .5]\n"
        "AttributeBegin\nTranslate 2 4 -2\nAreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\n"
        "Shape \"sphere\" \"float radius\" .8\nAttributeEnd\nMaterial \"matte\" \"rgb Kd\" [.5 .6 .7]\n"
        "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 9]\n"
        "AttributeBegin\nTranslate -1 1 0\nActiveTransform EndTime\nTranslate 1.2 0 0\nActiveTransform All\n"
        "Shape \"sphere\" \"float radius\" .9\nAttributeEnd\n",
        options);
}

RenderSettings settingsOf(const BuiltScene& built, uint64_t seed) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    settings.threads = 2;
    return settings;
}

Film filmOf(const BuiltScene& built) { return {built.resolution.x, built.resolution.y, built.pixelBounds}; }

RenderStats passes(
    const BuiltScene& built, uint64_t seed, const PassGoal& goal, Film& film, int most = 1 << 20,
    const PassDone& done = [](const Film&, const RenderStats&) { return std::nullopt; }) {
    return renderPasses(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                        settingsOf(built, seed), goal, most, film, done);
}

/// What the integrator's pictures converge to: by seeds that no test uses.
std::vector<double> expectation(const BuiltScene& built, int passes) {
    std::vector<double> luminances(built.resolution.x * size_t(built.resolution.y));
    for (int p = 0; p < passes; ++p) {
        const Image image = test::render(built, hashOf(p, 0x657870)).image;
        for (size_t i = 0; i < luminances.size(); ++i)
            luminances[i] += double(luminance(image.pixels[i])) / passes;
    }
    return luminances;
}

TEST(Passes, TheNoiseTargetIsMet) {
    for (const auto& [integrator, target] :
         {std::pair("supersample", 0.04), std::pair("msaa", 0.2), std::pair("msaa-cache", 0.04)}) {
        const BuiltScene built = buildWith(integrator);
        const std::vector<double> truth = expectation(built, 600);
        size_t held = 0, pixels = 0, made = 0;
        for (uint64_t seed = 0; seed < 20; ++seed) {
            Film film = filmOf(built);
            PassGoal goal;
            goal.noise = target;
            const RenderStats stats = passes(built, seed, goal, film);
            EXPECT_LE(*stats.noise, target);
            EXPECT_EQ(stats.samplesPerPixel, uint64_t(8 * stats.passes));
            made += size_t(stats.passes);
            for (size_t i = 0; i < truth.size(); ++i, ++pixels)
                held += std::abs(luminance(film.image().pixels[i]) - truth[i]) <=
                        target * std::max<double>(truth[i], NoiseEstimate::kFloor);
        }
        const double share = double(held) / double(pixels);
        EXPECT_GE(share, 0.95) << integrator << ", " << double(made) / 20 << " passes";
        EXPECT_LT(share, 0.9999) << integrator << ": far more than was asked for";
    }
}

TEST(Passes, TheDeadlineIsKept) {
    for (const char* integrator : {"supersample", "msaa-cache"}) {
        const BuiltScene built = buildWith(integrator);
        Film film = filmOf(built);
        PassGoal goal;
        goal.deadline = Clock::now() + 300ms;
        const RenderStats stats = passes(built, 1, goal, film);
        EXPECT_LT(Clock::now(), *goal.deadline + 50ms) << "a batch may be under way";
        EXPECT_GE(stats.passes, 3);
        for (const PixelAccumulator& sum : film.sums())
            ASSERT_EQ(sum.good(), stats.samplesPerPixel) << "quality is uniform";
    }
}

TEST(Passes, TheFirstPassIsMadeInAnyCase) {
    const BuiltScene built = buildWith("supersample");
    Film film = filmOf(built);
    PassGoal goal;
    goal.deadline = Clock::now() - 1s;
    const RenderStats stats = passes(built, 1, goal, film);
    EXPECT_EQ(stats.passes, 1);
    EXPECT_EQ(stats.samplesPerPixel, 1u);
    EXPECT_EQ(film.sums()[0].good(), 1u);
}

TEST(Passes, TheyGrowUpToTheMost) {
    const BuiltScene built = buildWith("supersample");
    Film film = filmOf(built);
    std::vector<uint64_t> samples;
    PassGoal goal;
    goal.deadline = Clock::now() + 1h;
    passes(built, 1, goal, film, 8,
           [&](const Film&, const RenderStats& stats) -> std::optional<Clock::time_point> {
               samples.push_back(stats.samplesPerPixel);
               return samples.size() == 6 ? Clock::now() - 1s : Clock::now() + 1h;
           });
    EXPECT_EQ(samples, (std::vector<uint64_t>{1, 5, 13, 21, 29, 37}));
}

TEST(Passes, TheyAreIndependentRendersOfTheirOwnSeeds) {
    // Two passes: the plain render of the seed, and one of the seed's hash.
    const BuiltScene built = buildWith("msaa-cache", 4);
    Film film = filmOf(built), a = filmOf(built), b = filmOf(built);
    PassGoal goal;
    goal.noise = 1e-9;
    goal.deadline = Clock::now() + 1h;
    int made = 0;
    passes(built, 5, goal, film, 4, [&](const Film&, const RenderStats&) -> std::optional<Clock::time_point> {
        return Clock::now() + (++made == 2 ? -1s : 100s);
    });
    a.keepSums(), b.keepSums();
    for (const auto& [seed, to] : {std::pair(uint64_t(5), &a), std::pair(hashOf(5, 1), &b)})
        render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
               settingsOf(built, seed), *to);
    EXPECT_FALSE(a.sums() == b.sums());
    a.add(b);
    EXPECT_TRUE(a.sums() == film.sums());
}

TEST(Passes, DoublingEndsWithTheRenderItself) {
    for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
        const BuiltScene built = buildWith(integrator, 16);
        Film film = filmOf(built);
        std::vector<uint64_t> samples;
        const RenderStats stats =
            renderDoubling(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                           *built.filter, settingsOf(built, 2), film,
                           [&](const Film&, const RenderStats& so) -> std::optional<Clock::time_point> {
                               samples.push_back(so.samplesPerPixel);
                               return std::nullopt;
                           });
        EXPECT_EQ(samples, (std::vector<uint64_t>{1, 2, 4, 8, 16}));
        EXPECT_EQ(stats.passes, 5);
        const Image whole = test::render(built, 2).image;
        EXPECT_EQ(0, std::memcmp(whole.pixels.data(), film.image().pixels.data(),
                                 whole.pixels.size() * sizeof(Rgb)))
            << integrator;
    }
}

} // namespace
} // namespace strobe
