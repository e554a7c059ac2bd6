// Pilots of adaptive-cache.
#include "core/film/film.h"
#include "core/render/shade_pilot.h"
#include "sharing/emission/emission_refinement.h"
#include "sharing/pilots/block_chooser.h"
#include "sharing/pilots/block_pilot.h"
#include "sharing/pilots/sample_plan.h"
#include "sharing/pilots/sharing_plan.h"
#include "support/fence_scene.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <atomic>
#include <map>

namespace strobe {
namespace {

TEST(Brightness, LimitsAreFarAboveAFractionOfTheSamples) {
    Brightness half, other;
    for (int i = 1; i <= 500; ++i) {
        half.add(Rgb(0, float(i), 0), Rgb(0));
        other.add(Rgb(0, 0, float(500 + i)), Rgb(NAN));
    }
    half.add(other);
    const RareLimits limits = half.limits(0.1);
    // 100 of the 1000 samples are above 900. Bins are an eighth of an octave wide.
    EXPECT_GE(limits.of[int(LightPart::Direct)], 3 * 900.f);
    EXPECT_LE(limits.of[int(LightPart::Direct)], 3 * 900.f * 1.15f);
    EXPECT_EQ(limits.of[int(LightPart::Indirect)], RareLimits().of[int(LightPart::Indirect)]);
}

TEST(Brightness, BlackPartsAreNotLit) {
    Brightness brightness;
    EXPECT_EQ(brightness.litParts(), LightParts::all());
    brightness.add(Rgb(0), Rgb(0));
    EXPECT_EQ(brightness.litParts(), LightParts::all());
    brightness.add(Rgb(0, 1e-3f, 0), Rgb(0));
    LightParts direct;
    direct.add(LightPart::Direct);
    EXPECT_EQ(brightness.litParts(), direct);
    brightness.add(Rgb(0), Rgb(1));
    EXPECT_EQ(brightness.litParts(), LightParts::all());
}

/// A lit wall behind a thin black bar, the only cause of noise. Pixels are a fiftieth wide.
constexpr const char* kScene = R"(
Film "image" "integer xresolution" 200 "integer yresolution" 120
Sampler "sobol" "integer pixelsamples" 4
Integrator "directlighting"
Camera "orthographic" "float screenwindow" [-2 2 -1.2 1.2]
WorldBegin
LightSource "distant" "point3 from" [0 0 -1] "point3 to" [0 0 0] "rgb L" [1 1 1]
Material "matte" "rgb Kd" [.5 .5 .5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]
Material "matte" "rgb Kd" [0 0 0]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [.31 -9 2  .33 -9 2  .33 9 2  .31 9 2]
)";

/// Returns the context of a render of a scene, which must outlive it.
RenderContext contextOf(const BuiltScene& built) {
    RenderContext out{.sampling = {*built.sampler.sampler, *built.filter, 0}};
    out.samplesPerPixel = built.sampler.samplesPerPixel;
    out.pixelBounds = out.pilotBounds = built.pixelBounds;
    out.makePilotRenderer = [&built](IntegratorState& state, int samplesPerPixel) {
        return makePilotRenderer(*built.scene, state, *built.shader, *built.sampler.sampler, *built.filter,
                                 samplesPerPixel);
    };
    return out;
}

class PairPilotTest : public testing::Test {
  protected:
    size_t blockCount(const PairPilot& pilot) const { return pilot.blocks().factors().size(); }
    double pairs(const PairPilot& pilot, size_t block) const {
        return double(pilot.noise(0, block).pairs + pilot.noise(1, block).pairs);
    }

    const BuiltScene built = test::build(kScene);
    const RenderContext context = contextOf(built);
};

TEST_F(PairPilotTest, HasPairsInHalfOfTheBlocksFirstAndThenInAll) {
    for (const double samples : {2., 4., 16., 64.}) {
        PairPilot pilot(*built.scene, context, samples);
        pilot.renderFirst();
        size_t rendered = 0;
        for (size_t i = 0; i < blockCount(pilot); ++i)
            rendered += pairs(pilot, i) > 0;
        EXPECT_NEAR(double(rendered), 0.5 * double(blockCount(pilot)), 0.1 * double(blockCount(pilot)));
        const uint64_t first = pilot.counters().visibilitySamples;
        pilot.renderRest();
        const double perBlock = pairs(pilot, 0);
        for (size_t i = 0; i < blockCount(pilot); ++i) {
            EXPECT_EQ(pairs(pilot, i), perBlock) << i;
            EXPECT_GT(pilot.rays(i), 0) << i;
        }
        const double share = double(pilot.counters().visibilitySamples) / (samples * 200 * 120);
        EXPECT_LE(share, std::max(0.021, 2 * 8 / (64 * samples))); // eight pixels of a block, or more
        EXPECT_LE(double(first), 0.28 * double(pilot.counters().visibilitySamples));
    }
}

/// The fence covers half of two columns of pixels, where the variance of the radiance L is L^2 / 4 for
/// independent samples. Those of a pair are stratified, which at most doubles it.
TEST_F(PairPilotTest, MeasuresTheVariance) {
    PairPilot pilot(*built.scene, context, 64);
    pilot.renderFirst();
    pilot.renderRest();
    double outside = 0, inside = 0, blocks = 0;
    for (size_t i = 0; i < blockCount(pilot); ++i) {
        const BlockNoise &a = pilot.noise(0, i), &b = pilot.noise(1, i);
        const bool hasFence = pilot.boundsOf(i).x0 == 112;
        (hasFence ? inside : outside) += double(a.all.variance + b.all.variance) / pairs(pilot, i);
        blocks += hasFence;
    }
    EXPECT_EQ(outside, 0);
    const double variance = sqr(0.5 / 3.14159) / 4 * 2 / 8; // two of eight columns
    EXPECT_GT(inside / blocks, 0.7 * variance);
    EXPECT_LT(inside / blocks, 2.3 * variance);
}

/// A quad that covers half of the view, and something else in the world.
std::string quadScene(const std::string& other) {
    return test::frontView(4, other + R"(
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-9 -9 5  0 -9 5  0 9 5  -9 9 5]
)");
}

/// The edges of a background are long, so that pairs show their noise.
TEST(PairPilot, BackgroundsAreNoLamps) {
    for (const bool isLamp : {false, true}) {
        const BuiltScene built = test::build(
            quadScene(isLamp ? "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] \"bool twosided\" true"
                             : "LightSource \"infinite\" \"rgb L\" [3 3 3]"));
        const RenderContext context = contextOf(built);
        PairPilot pilot(*built.scene, context, 4);
        pilot.renderFirst();
        EXPECT_EQ(pilot.seesLamps(), isLamp);
    }
}

/// Few more camera rays hardly lower the error of an image whose noise is elsewhere.
TEST(EmissionRefinement, MustGainEnough) {
    const BuiltScene built =
        test::build(quadScene("AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] \"bool twosided\" true"));
    const RenderContext context = contextOf(built);
    EmissionPilot noise;
    const auto isRefined = [&] {
        return !EmissionRefinement(*built.scene, context.sampling, built.pixelBounds, 4, noise).isEmpty();
    };
    EXPECT_TRUE(isRefined());
    noise.minGain = 1e6;
    EXPECT_FALSE(isRefined());
}

TEST_F(PairPilotTest, NoisyBlocksAreChosenMoreOften) {
    PairPilot pilot(*built.scene, context, 64);
    pilot.renderFirst();
    pilot.renderRest();
    const BlockChooser chooser(pilot);
    constexpr int kChoices = 100000;
    std::map<bool, int> counts;
    std::map<size_t, double> weights;
    for (size_t i = 0; i < kChoices; ++i) {
        const BlockChoice choice = chooser.choose(i);
        const int x = pilot.boundsOf(choice.block).x0;
        ++counts[x >= 104 && x <= 120]; // the fence and the neighbors
        weights[choice.block] += choice.weight;
    }
    EXPECT_GT(counts[true], 0.6 * kChoices); // two thirds by noise, and some of the last third
    EXPECT_EQ(weights.size(), blockCount(pilot));
    // Weighted, all blocks count alike.
    const double expected = kChoices / 3. / double(blockCount(pilot));
    for (const auto& [block, weight] : weights)
        EXPECT_NEAR(weight, expected, 0.1 * expected) << block;
}

/// A ball in the corner of a white room under a small lamp: indirect light is noisy and smooth.
constexpr const char* kSmoothScene = R"(
Film "image" "integer xresolution" 64 "integer yresolution" 48
Sampler "sobol" "integer pixelsamples" 64
Integrator "path"
LookAt 0 1 -3  0 1 0  0 1 0
Camera "perspective" "float fov" 60
WorldBegin
AttributeBegin
  Translate 1 2.8 -1
  AreaLightSource "diffuse" "rgb L" [300 300 300]
  Shape "sphere" "float radius" .05
AttributeEnd
Material "matte" "rgb Kd" [.9 .9 .9]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7]
  "point3 P" [-3 0 -4  3 0 -4  3 3 -4  -3 3 -4  -3 0 3  3 0 3  3 3 3  -3 3 3]
Translate 0 1 1
Shape "sphere" "float radius" .6
)";

TEST(BlockChooser, TellsHowMuchOfTheNoiseIsThatOfIndirectLight) {
    const auto gainIn = [](const char* text) {
        const BuiltScene built = test::build(text);
        const RenderContext context = contextOf(built);
        PairPilot pairs(*built.scene, context, 16);
        pairs.renderFirst();
        return BlockChooser(pairs).gainWithoutIndirect();
    };
    EXPECT_EQ(gainIn(kScene), 1); // direct light only
    EXPECT_GT(gainIn(kSmoothScene), 2);
}

/// Of smooth light, sharing leaves less than a third of the error of indirect light.
TEST(BlockRenderer, MeasuresTheErrorsOfSharing) {
    const BuiltScene built = test::build(kSmoothScene);
    const RenderContext context = contextOf(built);
    BlockRenderer renderer(*built.scene, context, 16, 3, LightParts::all());
    BlockPilot sum;
    for (uint64_t i = 0; i < 16; ++i) {
        BlockPilot block;
        const int x = 16 * int(i % 4), y = 12 * int(i / 4);
        block.bounds = {x, y, x + 8, y + 8};
        renderer.render({2 * i, 2 * i + 1}, block);
        EXPECT_EQ(block.pixels, 64);
        for (size_t choice = 0; choice < kSharingChoiceCount; ++choice)
            sum.errors[choice] += block.errors[choice];
    }
    EXPECT_LT(sum.errors[kSharesIndirect], 0.33 * sum.errors[0]);
    EXPECT_LT(sum.errors[kSharesBoth], 0.33 * sum.errors[0]);
    EXPECT_GT(sum.errors[kSharesDirect], 0.5 * sum.errors[0]);
}

/// The bias of the estimates does not fall with the number of samples, and the noise does.
TEST(SharingPlan, RendersOfManySamplesShareLess) {
    const BuiltScene built = test::build(kSmoothScene);
    RenderContext context = contextOf(built);
    const auto sharesWith = [&](int samples) {
        context.samplesPerPixel = samples;
        PairPilot pairs(*built.scene, context, samples);
        pairs.renderFirst();
        return !planSharing(*built.scene, context, pairs, {}).parts.isEmpty();
    };
    EXPECT_TRUE(sharesWith(64));
    EXPECT_FALSE(sharesWith(1 << 20));
}

/// The wall of kScene has no noise without the bar.
TEST(SharingPlan, BlocksAreRenderedOnlyIfSharingMayGain) {
    const auto blockRenderers = [](const std::string& scene, const std::optional<LightParts>& chosen = {}) {
        const BuiltScene built = test::build(scene);
        RenderContext context = contextOf(built);
        PairPilot pairs(*built.scene, context, 4);
        pairs.renderFirst();
        std::atomic<int> count = 0;
        const auto make = context.makePilotRenderer;
        context.makePilotRenderer = [&](IntegratorState& state, int samplesPerPixel) {
            ++count;
            return make(state, samplesPerPixel);
        };
        planSharing(*built.scene, context, pairs, {.chosen = chosen});
        return int(count);
    };
    const std::string noisy = kScene,
                      even = noisy.substr(0, noisy.find("Material \"matte\" \"rgb Kd\" [0 0 0]"));
    EXPECT_EQ(blockRenderers(even), 0);
    EXPECT_GT(blockRenderers(even, LightParts::all()), 0);
    EXPECT_GT(blockRenderers(noisy), 0);
}

/// Plans renders of kSmoothScene with 16 samples per pixel.
struct SmoothPlanner {
    SmoothPlanner() { pairs.renderFirst(); }
    SharingPlan planWith(const SharingOptions& options) {
        return planSharing(*built.scene, context, pairs, options);
    }
    static RenderContext makeContext(const BuiltScene& built) {
        RenderContext out = contextOf(built);
        out.samplesPerPixel = kSamples;
        return out;
    }

    static constexpr int kSamples = 16;
    const BuiltScene built = test::build(kSmoothScene);
    RenderContext context = makeContext(built);
    PairPilot pairs{*built.scene, context, kSamples};
};

/// Where a pixel has several cells, sharing takes longer.
TEST(SharingPlan, ManyCellsTakeTime) {
    SmoothPlanner planner;
    const auto overheadWith = [&](float cellSize) {
        return planner.planWith({.cellSize = cellSize, .chosen = LightParts::all()}).overhead.ofPixels;
    };
    EXPECT_GT(overheadWith(0.5f), 1.2 * overheadWith(3));
}

TEST(SharingPlan, SharesNothingThatTakesMoreThanTheLimit) {
    SmoothPlanner planner;
    const auto planWith = [&](size_t limit) {
        SharingOptions options;
        options.memoryLimit = limit;
        return planner.planWith(options);
    };
    const SharingPlan refused = planWith(1);
    EXPECT_TRUE(refused.parts.isEmpty());
    EXPECT_TRUE(planWith(refused.bytes - 1).parts.isEmpty());
    EXPECT_FALSE(planWith(refused.bytes).parts.isEmpty());
    planner.context.keepsRecords = true; // their memory adds to it
    EXPECT_TRUE(planWith(refused.bytes).parts.isEmpty());
}

/// A floor and a wall that the camera sees from the side. Near the wall, indirect light is noisy.
constexpr const char* kWall = R"(
LightSource "distant" "point3 from" [-1 0 -1] "point3 to" [0 0 0] "rgb L" [1 1 1]
Material "matte" "rgb Kd" [.9 .9 .9]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [1.5 -9 4.5  1.5 9 4.5  1.5 9 5  1.5 -9 5]
)";

/// Few pairs hit the rare bright samples of indirect light, so that plans for its noise alone lose.
TEST(SamplePlan, NoiseOfIndirectLightAloneMakesNoPlan) {
    constexpr int kSamples = 4;
    const BuiltScene built = test::build(test::frontView(kSamples, kWall, "path"));
    const RenderContext context = contextOf(built);
    PairPilot pairs(*built.scene, context, kSamples);
    pairs.renderFirst();
    EXPECT_FALSE(planSamples(pairs, kSamples, SharingPlan()).has_value());
}

/// Sharing leaves more noise of indirect light where it has rare bright samples: it is clipped like the light
/// whose noise a plan lowers.
TEST(PairPilot, IndirectLightIsClippedToTheSamplesOfAPixel) {
    std::string bright = kWall;
    bright.replace(bright.find("[1 1 1]"), 7, "[9 9 9]");
    const BuiltScene built = test::build(test::frontView(4, bright, "path"));
    const RenderContext context = contextOf(built);
    const auto noiseWith = [&](int samples) {
        PairPilot pairs(*built.scene, context, samples);
        pairs.renderFirst();
        double sum = 0, count = 0;
        for (size_t i = 0; i < pairs.blocks().factors().size(); ++i) {
            sum += double(pairs.noise(0, i).direct.other + pairs.noise(1, i).direct.other);
            count += double(pairs.pairs(i));
        }
        return sum / count;
    };
    EXPECT_GT(noiseWith(8), 1.5 * noiseWith(1));
}

/// Where the reconstruction takes long, more samples pay: its time does not grow with them.
TEST(SamplePlan, CountsTheTimeOfSharing) {
    constexpr int kSamples = 16, kBars = 14;
    const BuiltScene built = test::build(test::fenceScene(kSamples, kBars));
    const RenderContext context = contextOf(built);
    const auto samplesWith = [&](const SharingOverhead& overhead) {
        PairPilot pairs(*built.scene, context, kSamples);
        pairs.renderFirst();
        SharingPlan sharing;
        sharing.parts = LightParts::all();
        sharing.overhead = overhead;
        const auto factors = planSamples(pairs, kSamples, sharing);
        int sum = 0;
        for (const uint8_t factor : factors ? factors->factors() : std::vector<uint8_t>())
            sum += factor;
        return sum;
    };
    EXPECT_GT(samplesWith({0, 1}), samplesWith({0, 0}));
    EXPECT_LT(samplesWith({3, 1}), samplesWith({0, 1}));
}

} // namespace
} // namespace strobe
