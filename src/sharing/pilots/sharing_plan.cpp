#include "sharing/pilots/sharing_plan.h"

#include "core/math/hash.h"
#include "core/util/parallel.h"
#include "sharing/pilots/block_chooser.h"
#include "sharing/pilots/block_pilot.h"
#include "sharing/pilots/sample_plan.h"
#include "sharing/pilots/verdict.h"

#include <algorithm>
#include <cmath>

namespace strobe {

namespace {

/// The seeds of the two renders of a block. They do not depend on the seed of the render, so that renders of
/// a scene with different seeds share the same parts.
constexpr uint64_t kSeeds[] = {0x70696c6f74, 0x74706c696f};

/// Returns the number of cells per pixel of blocks. Blocks have cells at their borders, images have fewer.
double cellsPerPixelIn(std::span<const BlockPilot> pilots) {
    double cells = 0, pixels = 0;
    for (const BlockPilot& pilot : pilots) {
        cells += pilot.weight * pilot.cells;
        pixels += pilot.weight * pilot.pixels;
    }
    return cells / pixels;
}

/// Returns the number of cells per pixel beyond that of a smooth surface: a lens or motion spreads the
/// samples of a pixel over many cells.
double manyCellsIn(std::span<const BlockPilot> pilots) {
    constexpr double kOfSmoothSurface = 0.6; // measured
    return std::max(cellsPerPixelIn(pilots) - kOfSmoothSurface, 0.);
}

/// Returns the time of sharing both parts. The model of the times was fitted to those of all scenes of this
/// project on one machine: the times decide about pixels, so that they cannot be measured here. Three in four
/// times of renders are within a factor of 1.5 of the model, all within 2.1.
SharingOverhead overheadOf(const Scene& scene, double samplesPerPixel, const Counters& counters,
                           std::span<const BlockPilot> pilots) {
    // Nanoseconds per sample, per sample with a first vertex, per pixel, and per cell of manyCellsIn:
    constexpr double kObserve = 30, kRecord = 110, kFinishPixel = 1350, kReconstructPixel = 90, kCell = 700;
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
    const double ofPixel = kFinishPixel + kReconstructPixel * recorded + kCell * manyCellsIn(pilots);
    const double ofRenderedSample = render / samples;
    return {(kObserve + kRecord * recorded) / ofRenderedSample, ofPixel / samplesPerPixel / ofRenderedSample};
}

/// Returns whether the blocks show hardly any of the noise that the pairs of all blocks have: it is that of
/// rare bright samples, which the blocks missed. With errors that the reconstruction estimated, blocks showed
/// 0.04 to 9 times of it in 65 of 68 renders of this project, and less than 0.01 in the other three.
bool missNoise(std::span<const BlockPilot> pilots, const BlockChooser& chooser, int pilotSamples) {
    constexpr double kLeast = 0.02, kBlockPixels = PairPilot::kBlockSize * PairPilot::kBlockSize;
    double error = 0; // without sharing: mean of the channels
    for (const BlockPilot& pilot : pilots)
        error += pilot.weight * pilot.errors[0] / 3;
    return error < kLeast * double(pilots.size()) * chooser.meanNoise() * kBlockPixels / pilotSamples;
}

/// The blocks of the pilot.
struct PilotSize {
    int samples;  ///< per pixel
    size_t count; ///< of the blocks; up to twice as many if the verdict is uncertain
};

PilotSize pilotSizeFor(double samplesPerPixel, const PixelBounds& bounds) {
    constexpr int kBlockPixels = PairPilot::kBlockSize * PairPilot::kBlockSize;
    constexpr int kMinSamples = 16, kMaxSamples = 64, kMinBlocks = 4, kMaxBlocks = 40;
    constexpr double kPilotShare = 0.0015; // of the samples of the render, for each of the two renders
    // Direct light converges faster than in proportion to the samples, so that few would mislead.
    const int samples = int(
        std::min(samplesPerPixel, std::clamp(samplesPerPixel / 2, double(kMinSamples), double(kMaxSamples))));
    const double pixels = double(bounds.width()) * bounds.height();
    const int affordable = int(kPilotShare * pixels * samplesPerPixel / (kBlockPixels * samples));
    return {samples, size_t(std::clamp(affordable, kMinBlocks, kMaxBlocks))};
}

/// Chooses, renders and appends `count` blocks.
void addBlocks(size_t count, const BlockChooser& chooser, const PairPilot& pairs, BlockRenderer& renderer,
               std::vector<BlockPilot>& pilots) {
    const size_t first = pilots.size();
    for (size_t i = first; i < first + count; ++i) {
        const BlockChoice choice = chooser.choose(i);
        pilots.emplace_back();
        pilots.back().bounds = pairs.boundsOf(choice.block);
        pilots.back().weight = choice.weight;
    }
    parallelFor(count, [&](size_t i) {
        renderer.render({hashCombine(kSeeds[0], first + i), hashCombine(kSeeds[1], first + i)},
                        pilots[first + i]);
    });
}

/// Returns the means over the pixels of the blocks. `errorScale`: the error of other light in the render,
/// relative to that in the pilot.
EmissionPilot meanEmission(std::span<const BlockPilot> pilots, double errorScale) {
    double weights = 0, error = 0, coefficient = 0;
    for (const BlockPilot& pilot : pilots) {
        weights += pilot.weight * pilot.pixels;
        error += pilot.weight * pilot.sharedVariance;
        coefficient += pilot.weight * pilot.emissionCoefficient;
    }
    EmissionPilot mean;
    mean.otherError = error * errorScale / weights;
    mean.coefficient = coefficient / weights;
    return mean;
}

/// Returns the plan of a render that shares nothing.
SharingPlan planWithoutSharing(const PairPilot& pairs) {
    SharingPlan plan;
    if (pairs.seesLamps())
        plan.emission = pairs.emission();
    return plan;
}

} // namespace

size_t sharingBytes(const RenderContext& context, double cellsPerPixel) {
    // Fitted to the peaks of 21 renders of this project's scenes, which are 0.67 to 1.18 times this.
    constexpr double kPixel = 450, kCell = 150, kWithRecords = 2.2;
    const double pixels = double(context.pilotBounds.width()) * context.pilotBounds.height();
    const double bytes = pixels * (kPixel + kCell * cellsPerPixel);
    return size_t(context.keepsRecords ? kWithRecords * bytes : bytes);
}

SharingPlan planSharing(const Scene& scene, const RenderContext& context, const PairPilot& pairs,
                        const SharingOptions& options) {
    constexpr double kPasses = 64;      // the samples of passes, whose number is not known
    constexpr double kAdaptiveTime = 2; // of adaptive samples relative to uniform ones: see planSamples
    // The fraction of the samples that are recorded one by one falls with their number, so that the limits
    // rise.
    constexpr double kMaxRare = 0.005;
    const double samples = context.isPass ? kPasses : context.samplesPerPixel;
    const PilotSize size = pilotSizeFor(samples, context.pilotBounds);
    // Up to twice the samples of the blocks, the constants of the verdict include that renders gain less.
    const double sampleRatio = std::min(1., 2 * size.samples / samples);
    const BlockChooser chooser(pairs);
    if (!options.chosen && chooser.meanNoise() == 0)
        return planWithoutSharing(pairs);
    const PilotedLight light{pairs.brightness().litParts(), chooser.gainWithoutIndirect()};
    BlockRenderer renderer(scene, context, size.samples, options.cellSize, light.lit);
    std::vector<BlockPilot> pilots;
    SharingPlan plan;
    Verdict verdict;
    bool missesNoise = false;
    do {
        addBlocks(size.count, chooser, pairs, renderer, pilots);
        plan.overhead = overheadOf(scene, samples, pairs.counters(), pilots);
        missesNoise = missNoise(pilots, chooser, size.samples);
        verdict = decideSharing(pilots, light, plan.overhead.timeOf(1) - 1, sampleRatio);
        if (options.adaptsSamples) {
            const double overhead = plan.overhead.timeOf(kAdaptiveTime) / kAdaptiveTime - 1;
            const Verdict adaptive = decideSharing(pilots, light, overhead, sampleRatio);
            // The promise is looked for only if it matters: that takes as long as a block.
            if (adaptive.parts == verdict.parts ||
                promisesSamplePlan(pairs, samples, {LightParts::all(), plan.overhead, {}, {}}))
                verdict = adaptive;
        }
    } while (!options.chosen && pilots.size() < 2 * size.count && (missesNoise || !verdict.isCertain));
    if (missesNoise && light.lit.has(LightPart::Indirect))
        verdict.parts.add(LightPart::Indirect);
    plan.parts = options.chosen.value_or(verdict.parts);
    if (plan.parts.isEmpty())
        return planWithoutSharing(pairs);
    plan.bytes = sharingBytes(context, cellsPerPixelIn(pilots));
    if (plan.bytes > options.memoryLimit) {
        SharingPlan refused = planWithoutSharing(pairs);
        refused.bytes = plan.bytes;
        return refused;
    }
    plan.rareLimits = pairs.brightness().limits(std::min(kMaxRare, 1 / samples));
    plan.emission = meanEmission(pilots, size.samples / samples);
    return plan;
}

} // namespace strobe
