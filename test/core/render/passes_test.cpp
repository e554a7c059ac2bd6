// Progressive rendering: deadlines, noise targets, and equal sample counts of all pixels.
#include "core/math/hash.h"
#include "core/render/passes.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>
#include <thread>
#include <utility>

namespace strobe {
namespace {

using Clock = PassGoal::Clock;
using namespace std::chrono_literals;

/// Motion, a floor with shadows, edges.
const std::string kScene = R"(
    TransformTimes 0 1
    Film "image" "integer xresolution" 14 "integer yresolution" 10
    Integrator "directlighting"
    LookAt 0 2 -6  0 .5 0  0 1 0
    Camera "perspective" "float fov" 50
    WorldBegin
    LightSource "infinite" "rgb L" [.3 .4 .5]
    AttributeBegin
      Translate 2 4 -2
      AreaLightSource "diffuse" "rgb L" [9 9 9]
      Shape "sphere" "float radius" .8
    AttributeEnd
    Material "matte" "rgb Kd" [.5 .6 .7]
    Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
    AttributeBegin
      Translate -1 1 0
      ActiveTransform EndTime
      Translate 1.2 0 0
      ActiveTransform All
      Shape "sphere" "float radius" .9
    AttributeEnd
)";

BuiltScene buildWith(const std::string& integrator, int samplesPerPixel = 8) {
    BuildOptions options;
    options.integrator = integrator;
    options.samplesPerPixel = samplesPerPixel;
    return test::build(kScene, options);
}

RenderSettings settingsOf(const BuiltScene& built, uint64_t seed) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    settings.threads = 2;
    return settings;
}

Film filmOf(const BuiltScene& built) { return {built.resolution.x, built.resolution.y, built.pixelBounds}; }

RenderStats renderInPasses(
    const BuiltScene& built, uint64_t seed, const PassGoal& goal, Film& film, int maxSamples = 1 << 20,
    const PassDone& done = [](const Film&, const RenderStats&) { return std::nullopt; }) {
    return renderPasses(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                        settingsOf(built, seed), goal, maxSamples, film, done);
}

/// Estimates the expected luminance of each pixel from passes with seeds that no test uses.
std::vector<double> expectedLuminance(const BuiltScene& built, int passes) {
    std::vector<double> luminances(built.resolution.x * size_t(built.resolution.y));
    for (int p = 0; p < passes; ++p) {
        const Image image = test::render(built, hashOf(p, 0x657870)).image;
        for (size_t i = 0; i < luminances.size(); ++i)
            luminances[i] += double(luminance(image.pixels[i])) / passes;
    }
    return luminances;
}

TEST(Passes, NoiseTargetsAreMet) {
    for (const auto& [integrator, target] :
         {std::pair("supersample", 0.04), std::pair("msaa", 0.2), std::pair("msaa-cache", 0.04)}) {
        const BuiltScene built = buildWith(integrator);
        const std::vector<double> expected = expectedLuminance(built, 600);
        size_t covered = 0, pixels = 0, passes = 0;
        for (uint64_t seed = 0; seed < 20; ++seed) {
            Film film = filmOf(built);
            PassGoal goal;
            goal.noise = target;
            const RenderStats stats = renderInPasses(built, seed, goal, film);
            EXPECT_LE(*stats.noise, target);
            EXPECT_EQ(stats.samplesPerPixel, uint64_t(8 * stats.passes));
            passes += size_t(stats.passes);
            for (size_t i = 0; i < expected.size(); ++i, ++pixels)
                covered += std::abs(luminance(film.image().pixels[i]) - expected[i]) <=
                           target * std::max<double>(expected[i], NoiseEstimate::kFloor);
        }
        const double share = double(covered) / double(pixels);
        EXPECT_GE(share, 0.95) << integrator << ", " << double(passes) / 20 << " passes";
        EXPECT_LT(share, 0.9999) << integrator << ": far below the target";
    }
}

/// Passes of one sample cannot share.
TEST(Passes, OfANoiseTargetHaveTheFewestSamplesThatShare) {
    const BuiltScene built = buildWith("adaptive-cache", 1);
    Film film = filmOf(built);
    PassGoal goal;
    goal.noise = 10;
    const RenderStats stats = renderInPasses(built, 1, goal, film);
    EXPECT_EQ(stats.samplesPerPixel, 2u * stats.passes);
}

TEST(Passes, DeadlinesAreKept) {
    for (const char* integrator : {"supersample", "msaa-cache"}) {
        const BuiltScene built = buildWith(integrator);
        Film film = filmOf(built);
        PassGoal goal;
        goal.deadline = Clock::now() + 300ms;
        const RenderStats stats = renderInPasses(built, 1, goal, film);
        EXPECT_LT(Clock::now(), *goal.deadline + 50ms) << "the current batches are finished";
        EXPECT_GE(stats.passes, 3);
        for (const PixelAccumulator& sum : film.sums())
            ASSERT_EQ(sum.validCount(), stats.samplesPerPixel) << "all pixels have equally many samples";
    }
}

TEST(Passes, TheFirstPassIsAlwaysCompleted) {
    const BuiltScene built = buildWith("supersample");
    Film film = filmOf(built);
    PassGoal goal;
    goal.deadline = Clock::now() - 1s;
    const RenderStats stats = renderInPasses(built, 1, goal, film);
    EXPECT_EQ(stats.passes, 1);
    EXPECT_EQ(stats.samplesPerPixel, 1u);
    EXPECT_EQ(film.sums()[0].validCount(), 1u);
}

/// adaptive-cache needs two samples to share light.
TEST(Passes, TheFirstPassHasTheFewestSamplesThatShare) {
    for (const auto& [maxSamples, samples] : {std::pair(1, 1), std::pair(8, 2)}) {
        const BuiltScene built = buildWith("adaptive-cache");
        Film film = filmOf(built);
        PassGoal goal;
        goal.deadline = Clock::now() - 1s;
        EXPECT_EQ(renderInPasses(built, 1, goal, film, maxSamples).samplesPerPixel, uint64_t(samples));
    }
}

/// An integrator whose state takes a while to begin and to finish.
class SlowIntegrator : public Integrator {
  public:
    explicit SlowIntegrator(std::shared_ptr<const Integrator> fast) : m_integrator(std::move(fast)) {}
    BiasBound biasBound(const Scene& scene) const override { return m_integrator->biasBound(scene); }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext& context) const override {
        std::this_thread::sleep_for(kBegin);
        return std::make_unique<State>(m_integrator->begin(scene, context));
    }

    static constexpr auto kBegin = 300ms, kFinish = 200ms;

  private:
    class State : public IntegratorState {
      public:
        explicit State(std::unique_ptr<IntegratorState> state) : m_state(std::move(state)) {}
        std::unique_ptr<IntegratorWorker> makeWorker() override { return m_state->makeWorker(); }
        void finish(Film& film, std::vector<float>*) const override {
            std::this_thread::sleep_for(kFinish);
            if (film.records().isEmpty())
                film.records().add(FilmRecord());
        }

      private:
        std::unique_ptr<IntegratorState> m_state;
    };
    const std::shared_ptr<const Integrator> m_integrator;
};

BuiltScene buildWithSlowIntegrator() {
    BuiltScene built = buildWith("supersample");
    built.integrator = std::make_shared<SlowIntegrator>(built.integrator);
    return built;
}

/// Neither the time that the state takes to begin nor that to finish is that of the samples of a pass.
TEST(Passes, OnlySamplesTakeTimeInProportionToTheirNumber) {
    const BuiltScene built = buildWithSlowIntegrator();
    Film film = filmOf(built);
    PassGoal goal;
    goal.deadline = Clock::now() + 10 * SlowIntegrator::kBegin;
    std::vector<uint64_t> samples;
    renderInPasses(built, 1, goal, film, 1 << 20,
                   [&](const Film&, const RenderStats& stats) -> std::optional<Clock::time_point> {
                       samples.push_back(stats.samplesPerPixel);
                       // There is time for passes of milliseconds, and to finish the film once.
                       return Clock::now() + 2 * SlowIntegrator::kFinish;
                   });
    ASSERT_EQ(samples.size(), 2u) << "for the first and the last pass";
    EXPECT_EQ(samples[0], 1u);
    EXPECT_GE(samples[1], 5u);
    goal.deadline = Clock::now() + 10 * SlowIntegrator::kBegin;
    Film other = filmOf(built);
    EXPECT_EQ(renderInPasses(built, 1, goal, other, 1 << 20,
                             [&](const Film&, const RenderStats&) { // not to finish it
                                 return std::optional(Clock::now() + SlowIntegrator::kFinish / 2);
                             })
                  .samplesPerPixel,
              1u);
}

/// Most of the time is for samples, even if a pass takes less time than to finish the film.
TEST(Passes, FinishTheFilmNowAndThen) {
    const BuiltScene built = buildWithSlowIntegrator();
    Film film = filmOf(built);
    PassGoal goal;
    goal.deadline = Clock::now() + SlowIntegrator::kBegin + 7 * SlowIntegrator::kFinish;
    int finished = 0;
    const RenderStats stats =
        renderInPasses(built, 1, goal, film, 1, [&](const Film& image, const RenderStats& now) {
            ++finished;
            EXPECT_EQ(image.sums().front().validCount(), now.samplesPerPixel);
            return std::nullopt;
        });
    EXPECT_LE(finished, 3) << "after the first pass, at most one within 7 times the duration, and the last";
    EXPECT_GE(finished, 2);
    EXPECT_GT(stats.passes, finished);
    EXPECT_EQ(film.sums().front().validCount(), stats.samplesPerPixel);
}

TEST(Passes, SampleCountsGrowUpToTheMaximum) {
    const BuiltScene built = buildWith("supersample");
    Film film = filmOf(built);
    std::vector<uint64_t> samples;
    PassGoal goal;
    goal.deadline = Clock::now() + 1h;
    renderInPasses(built, 1, goal, film, 8,
                   [&](const Film&, const RenderStats& stats) -> std::optional<Clock::time_point> {
                       samples.push_back(stats.samplesPerPixel);
                       return samples.size() == 6 ? Clock::now() - 1s : Clock::now() + 1h;
                   });
    EXPECT_EQ(samples, (std::vector<uint64_t>{1, 5, 13, 21, 29, 37}));
}

TEST(Passes, PassesAreIndependentRendersWithHashedSeeds) {
    // Two passes equal a render with the seed itself and a render with a hash of the seed.
    const BuiltScene built = buildWith("msaa-cache", 4);
    Film film = filmOf(built), first = filmOf(built), second = filmOf(built);
    PassGoal goal;
    goal.noise = 1e-9;
    goal.deadline = Clock::now() + 1h;
    int passes = 0;
    renderInPasses(built, 5, goal, film, 4,
                   [&](const Film&, const RenderStats&) -> std::optional<Clock::time_point> {
                       return Clock::now() + (++passes == 2 ? -1s : 100s);
                   });
    first.enableAccumulation();
    second.enableAccumulation();
    for (const auto& [seed, passFilm] : {std::pair(uint64_t(5), &first), std::pair(hashOf(5, 1), &second)})
        render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
               settingsOf(built, seed), *passFilm);
    EXPECT_FALSE(first.sums() == second.sums());
    first.merge(second);
    EXPECT_TRUE(first.sums() == film.sums());
}

TEST(Passes, DoublingGivesTheSameImageAsOnePass) {
    for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
        const BuiltScene built = buildWith(integrator, 16);
        Film film = filmOf(built);
        std::vector<uint64_t> samples;
        const RenderStats stats =
            renderDoubling(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                           *built.filter, settingsOf(built, 2), film,
                           [&](const Film&, const RenderStats& soFar) -> std::optional<Clock::time_point> {
                               samples.push_back(soFar.samplesPerPixel);
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
