#include "sharing/pilots/sharing_plan.h"

#include "core/math/hash.h"
#include "core/util/parallel.h"
#include "sharing/pilots/block_chooser.h"
#include "sharing/pilots/block_pilot.h"
#include "sharing/pilots/sample_plan.h"

#include <algorithm>
#include <cmath>

namespace strobe {

namespace {

/// The seeds of the two renders of a block. They do not depend on the seed of the render, so that renders of
/// a scene with different seeds share the same parts.
constexpr uint64_t kSeeds[] = {0x70696c6f74, 0x74706c696f};

/// Returns the time for recording and reconstruction of both parts relative to that of the render. The model
/// of the times was fitted to those of all scenes of this project on one machine: the times decide about
/// pixels, so that they cannot be measured here. Three in four times of renders are within a factor of 1.5 of
/// the model, all within 2.1.
double overheadOf(const Scene& scene, double samplesPerPixel, const Counters& counters) {
    // Nanoseconds per sample, per sample with a first vertex, and per pixel:
    constexpr double kObserve = 30, kRecord = 110, kFinishPixel = 1350, kReconstructPixel = 90;
    // The parts of the time of a ray, and the times of other steps:
    constexpr double kSimplestRay = 15, kRayPerDoubledGeometry = 1.1, kRayPerInstance = 15, kSurface = 155,
                     kFootprint = 330, kLightSample = 7;
    constexpr size_t kMaxInstances = 16; // of more, a ray meets few
    const TracerCounts& geometry = scene.tracer().counts();
    const double primitives = double(geometry.triangles + geometry.quadrics);
    const double ray = kSimplestRay + kRayPerDoubledGeometry * std::log2(1 + primitives) +
                       kRayPerInstance * double(std::min(geometry.instances, kMaxInstances));
    const double samples = double(std::max<uint64_t>(counters.visibilitySamples, 1));
    const double recorded = double(counters.shades) / samples;
    const double render = ray * double(counters.rays()) + kSurface * double(counters.surfaces) +
                          kFootprint * double(counters.footprints) +
                          kLightSample * double(counters.lightSamples);
    return (kObserve + kRecord * recorded + (kFinishPixel + kReconstructPixel * recorded) / samplesPerPixel) /
           (render / samples);
}

/// An adaptive render takes about this many times the samples of a uniform one (planSamples).
constexpr double kAdaptiveSamples = 2;

/// The overhead of both parts.
struct Overheads : SharingOverhead {
    bool adapts; ///< whether the numbers of samples may differ
    double least() const { return adapts ? adaptive : uniform; }
};

/// Returns true if the first render of the blocks shows that sharing cannot pay. The gain that LightSharing
/// estimates is up to three times too large. An estimated gain that hardly exceeds the ratio of the times
/// therefore decides against sharing. Gains below kNoPromise do not decide: a few bright samples can hide the
/// real gain.
bool isHopeless(std::span<const BlockPilot> pilots, double overhead) {
    constexpr double kLeastPromise = 1.25, kNoPromise = 1.5;
    double own = 0, shared = 0;
    for (const BlockPilot& pilot : pilots) {
        own += pilot.weight * pilot.ownVariance;
        shared += pilot.weight * pilot.variance;
    }
    return own > kNoPromise * shared && own < kLeastPromise * (1 + overhead) * shared;
}

/// Returns the part of the gain above 1 that is left in a render with so many more samples per pixel than the
/// pilot. The noise falls with the number of samples and the bias of the estimates does not: from 64 to 4096
/// samples, the gain above 1 falls with a power of 0.45 to 0.9 of their number (moving-pair,
/// anim-moving-reflection). Up to twice the samples of the pilot, the other constants include this.
double gainLeftOf(double samplesPerPixel, int pilotSamples) {
    constexpr double kPower = 0.6;
    return std::pow(std::min(1., 2 * pilotSamples / samplesPerPixel), kPower);
}

/// The decision about sharing.
struct Verdict {
    LightParts parts;      ///< to share
    bool isCertain = true; ///< hardly depends on the choice of the blocks
};

/// A sum over the pilot's blocks.
struct BlockSum {
    double sum = 0, deviation = 0; ///< and its standard error
};

/// Returns the sum of value(block).
template <class Value>
BlockSum sumOver(std::span<const BlockPilot> pilots, const Value& value) {
    double sum = 0, squares = 0;
    for (const BlockPilot& pilot : pilots) {
        const double x = value(pilot);
        sum += x;
        squares += sqr(x);
    }
    const double count = double(pilots.size());
    return {sum, std::sqrt(count / (count - 1) * std::max(squares - sqr(sum) / count, 0.))};
}

/// The gain of sharing some parts of the light.
struct SharingGain {
    LightParts parts;
    BlockSum gain;
};

/// Returns the gain of the parts that leave the least cost if they are shared. `cost` maps the error of a
/// block to its cost. The gain of a block is its cost without sharing minus `least` times its cost with it.
/// `lit`: the parts that are not black.
///
/// Direct light is not shared beside indirect light if its gain is negative, or less than `leastOfDirect` by
/// more than a standard error. Its gain is that of the blocks plus `missedOfDirect`. Both parameters are
/// fractions of the cost.
template <class Cost>
SharingGain gainOf(std::span<const BlockPilot> pilots, size_t clip, LightParts lit, double least,
                   double leastOfDirect, double missedOfDirect, const Cost& cost) {
    const auto costOf = [&](const BlockPilot& pilot, size_t choice) {
        return pilot.weight * cost(pilot.errors[clip][choice]);
    };
    double costs[kSharingChoiceCount];
    for (size_t choice = 0; choice < kSharingChoiceCount; ++choice)
        costs[choice] = sumOver(pilots, [&](const BlockPilot& pilot) { return costOf(pilot, choice); }).sum;
    const BlockSum measured = sumOver(pilots, [&](const BlockPilot& pilot) {
        return costOf(pilot, kSharesIndirect) - costOf(pilot, kSharesBoth);
    });
    const double scale = std::abs(costs[kSharesIndirect]), ofDirect = measured.sum + missedOfDirect * scale;
    const bool paysDirect =
        lit.has(LightPart::Direct) && ofDirect >= 0 && ofDirect + measured.deviation >= leastOfDirect * scale;
    size_t best = paysDirect ? kSharesBoth : kSharesIndirect;
    if (!lit.has(LightPart::Indirect) || costs[kSharesDirect] < costs[best])
        best = kSharesDirect;
    return {kSharingChoices[best], sumOver(pilots, [&](const BlockPilot& pilot) {
                return costOf(pilot, 0) - least * costOf(pilot, best);
            })};
}

/// Decides for the parts whose sharing leaves the least error, by the first of kErrorClips for which this
/// pays: for which the error per time falls by more than a fifth, and by more than half of the standard error
/// of the blocks' sum. If there is none, the roots of the errors decide about indirect light, so that a
/// single block does not: with the best distribution of samples, the product of error and time is the square
/// of their sum (Neyman allocation, for errors in proportion to 1/n; those of direct light fall faster). They
/// need no margin, as blocks without neighbors gain less than the image. `lit`: the parts that are not black.
/// `gainLeft`: see gainLeftOf.
Verdict decide(std::span<const BlockPilot> pilots, LightParts lit, const Overheads& overheads,
               double gainLeft) {
    constexpr double kMargin = 1.2, kStandardErrors = 0.5, kCertain = 1;
    Verdict verdict;
    const auto pays = [&](const SharingGain& of, double standardErrors) {
        const bool isCertain = std::abs(of.gain.sum) >= kCertain * of.gain.deviation;
        if (of.gain.sum > standardErrors * of.gain.deviation) {
            verdict = {of.parts, isCertain};
            return true;
        }
        verdict.isCertain = verdict.isCertain && isCertain;
        return false;
    };
    const auto leastInPilot = [&](double least) { return 1 + (least - 1) / (least > 1 ? gainLeft : 1); };
    // Sharing one part takes nine tenths of the overhead of both (measured: 0.86 to 0.92). Few blocks miss
    // penumbrae, which have the noise of direct light.
    constexpr double kOnePart = 0.9, kMissedOfDirect = 0.03;
    const double leastOfDirect = (1 + overheads.uniform) / (1 + kOnePart * overheads.uniform) - 1;
    const double least = leastInPilot(kMargin * (1 + overheads.uniform));
    for (size_t clip = 0; clip < kErrorClipCount; ++clip)
        if (pays(gainOf(pilots, clip, lit, least, leastOfDirect, kMissedOfDirect,
                        [](double error) { return error; }),
                 kStandardErrors))
            return verdict;
    // The noisy blocks of an adaptive render have several times as many samples as the pilot, and gain more:
    // from 4 to 16 samples, the gain of the errors rises 1.3 to 1.9 times (three scenes).
    constexpr double kMoreGain = 1.15;
    const double moreGain = overheads.adapts ? kMoreGain : 1;
    const double leastRoot = std::sqrt(leastInPilot((1 + overheads.least()) / sqr(moreGain)));
    const SharingGain gain =
        gainOf(pilots, kErrorClipCount - 1, lit, leastRoot, leastOfDirect / 2, kMissedOfDirect / 2,
               [](double error) { return std::sqrt(std::max(error, 0.)); });
    if (gain.parts.has(LightPart::Indirect))
        pays(gain, overheads.adapts ? 0 : kStandardErrors);
    return verdict;
}

/// The blocks of the pilot.
struct PilotSize {
    int samples;  ///< per pixel
    size_t count; ///< of the blocks that are rendered at once
    size_t limit; ///< of the blocks, if the verdict is uncertain
};

PilotSize pilotSizeFor(double samplesPerPixel, const PixelBounds& bounds) {
    constexpr int kBlockPixels = PairPilot::kBlockSize * PairPilot::kBlockSize;
    constexpr int kMinSamples = 16, kMaxSamples = 64, kMinBlocks = 5, kMaxBlocks = 40;
    constexpr double kPilotShare = 0.0025;
    // Direct light converges faster than in proportion to the samples, so that few would mislead.
    const int samples = int(
        std::min(samplesPerPixel, std::clamp(samplesPerPixel / 2, double(kMinSamples), double(kMaxSamples))));
    const double pixels = double(bounds.width()) * bounds.height();
    const int affordable = int(kPilotShare * pixels * samplesPerPixel / (kBlockPixels * samples));
    const size_t count = size_t(std::clamp(affordable, kMinBlocks, kMaxBlocks));
    // An uncertain verdict is worth twice as many blocks where this is not much of the render.
    return {samples, count, 2 * affordable >= kMinBlocks ? 2 * count : count};
}

/// Returns the means over the pixels of the blocks. `errorScale`: the error of other light in the render,
/// relative to that in the pilot.
EmissionPilot meanEmission(std::span<const BlockPilot> pilots, double errorScale) {
    double weights = 0;
    EmissionPilot mean{0, 0};
    for (const BlockPilot& pilot : pilots) {
        weights += pilot.weight * pilot.pixels;
        mean.otherError += pilot.weight * pilot.absoluteVariance;
        mean.coefficient += pilot.weight * pilot.emissionCoefficient;
    }
    return {mean.otherError * errorScale / weights, mean.coefficient / weights};
}

} // namespace

SharingPlan planSharing(const Scene& scene, const RenderContext& context, const PairPilot& pairs,
                        float cellSize, const std::optional<LightParts>& chosen, bool adaptsSamples) {
    constexpr double kPasses = 64; // the samples of passes, whose number is not known
    // The fraction of the samples that are recorded one by one falls with their number, so that the limits
    // rise.
    constexpr double kMaxRare = 0.005;
    const double samples = context.isPass ? kPasses : context.samplesPerPixel;
    const PilotSize size = pilotSizeFor(samples, context.pilotBounds);
    Overheads overheads{{overheadOf(scene, samples, pairs.counters()),
                         overheadOf(scene, kAdaptiveSamples * samples, pairs.counters())},
                        adaptsSamples};
    const double gainLeft = gainLeftOf(samples, size.samples);
    const BlockChooser chooser(pairs);
    const LightParts lit = pairs.brightness().litParts();
    BlockRenderer renderer(scene, context, size.samples, cellSize, lit);
    std::vector<BlockPilot> pilots;
    Verdict verdict;
    do {
        const size_t first = pilots.size();
        for (size_t i = first; i < first + size.count; ++i) {
            const BlockChoice choice = chooser.choose(i);
            pilots.emplace_back();
            pilots.back().bounds = pairs.boundsOf(choice.block);
            pilots.back().weight = choice.weight;
        }
        parallelFor(size.count, [&](size_t i) {
            renderer.renderFirst(hashCombine(kSeeds[0], first + i), pilots[first + i]);
        });
        if (first == 0) {
            const auto endsEarly = [&] { return !chosen && isHopeless(pilots, overheads.least()); };
            if (endsEarly()) // before a promise is looked for, which takes as long as a block
                return {};
            if (adaptsSamples && !promisesSamplePlan(pairs, samples, LightParts::all())) {
                overheads.adapts = false;
                if (endsEarly())
                    return {};
            }
        }
        parallelFor(size.count, [&](size_t i) {
            renderer.renderSecond(hashCombine(kSeeds[1], first + i), pilots[first + i]);
        });
        verdict = decide(pilots, lit, overheads, gainLeft);
    } while (pilots.size() < size.limit && !verdict.isCertain);
    SharingPlan plan;
    plan.rareLimits = pairs.brightness().limits(std::min(kMaxRare, 1 / samples));
    plan.parts = chosen.value_or(verdict.parts);
    if (!plan.parts.isEmpty())
        plan.overhead = overheads;
    plan.emission = meanEmission(pilots, size.samples / samples);
    return plan;
}

} // namespace strobe
