#include "sharing/pilots/sample_plan.h"

#include "core/math/simd4.h"
#include "core/util/memory.h"

#include <algorithm>
#include <cmath>

namespace strobe {

namespace {

constexpr int kPair = PairPilot::kPair;
constexpr int kMaxExponent = 4; ///< of the factors, which are powers of two
/// The least gain that is worth it. Small gains are those of squared errors only: structural errors grow.
constexpr double kMinGain = 1.3;
/// The largest time of the render relative to that with factors of 1.
constexpr double kMaxTime = 2;
/// The time of a sample whose path has no first vertex, in units of a ray.
constexpr float kMissTime = 0.3f;

/// The squared errors of pixels per sample:
enum ErrorLane {
    kRest,        ///< of all but shared indirect light
    kRawRest,     ///< the same, not clipped
    kClippedRest, ///< the same, of samples clipped to 1
    kShared       ///< of shared indirect light
};

/// The errors of pixels, by ErrorLane, and their time, per sample.
struct Costs {
    Float4 errors = {};
    float time = 0; ///< 0: not measured
};

/// Returns the cost of a block that has the samples of both `a` and `b`. `rays`: of a sample with a first
/// vertex.
Costs costOf(const BlockNoise& a, const BlockNoise& b, float rays, LightParts shared) {
    constexpr float kDark = 0.1f;
    const float pairs = a.pairs + b.pairs, samples = kPair * pairs;
    if (pairs == 0)
        return {};
    const float vertices = (a.vertices + b.vertices) / samples;
    const float weight = 1 / (pairs * ((a.radiance + b.radiance) / samples + kDark));
    const BlockNoise::Split &ofA = a.with(shared), &ofB = b.with(shared);
    const Float4 errors = {ofA.rest + ofB.rest, ofA.rawRest + ofB.rawRest, ofA.clippedRest + ofB.clippedRest,
                           ofA.shared + ofB.shared};
    return {weight * errors, kMissTime * (1 - vertices) + rays * vertices};
}

/// The costs of a block and its neighbors, with its density.
struct BlockCost : Costs {
    /// The binary logarithm of the density of samples, the root of the error over the time (Neyman
    /// allocation); -infinity without an error.
    float logDensity = -INFINITY;
};

/// The costs of all blocks: by each half of the pilot, and by the whole.
struct PilotCosts {
    std::vector<BlockCost> halves[kHalves], whole;

    PilotCosts(const PairPilot& pilot, LightParts shared) {
        const size_t count = pilot.blocks().factors().size();
        HugeBuffer<Sets> blocks(count);
        for (size_t i = 0; i < count; ++i) {
            const BlockNoise &a = pilot.noise(0, i), &b = pilot.noise(1, i);
            const float rays = pilot.rays(i);
            Sets sets;
            sets.set(0, costOf(a, {}, rays, shared));
            sets.set(1, costOf({}, b, rays, shared));
            sets.set(kWhole, costOf(a, b, rays, shared));
            blocks[i] = sets;
        }
        for (std::vector<BlockCost>* costs : {&halves[0], &halves[1], &whole})
            costs->reserve(count);
        for (size_t i = 0; i < count; ++i)
            addSmoothed(pilot, blocks, i);
    }

  private:
    static constexpr int kWhole = kHalves;
    /// The costs of a block, or sums over blocks: by each half of the pilot, then by the whole.
    struct Sets {
        Float4 errors[kHalves + 1] = {};
        Float4 times = {};   ///< by set
        Float4 weights = {}; ///< by set; 0: not measured
        void set(int k, const Costs& cost) {
            errors[k] = cost.errors;
            times[k] = cost.time;
            weights[k] = cost.time > 0 ? 1 : 0;
        }
        void add(const Sets& other, float weight) {
            for (int k = 0; k <= kWhole; ++k)
                errors[k] += weight * other.errors[k];
            times += weight * other.times;
            weights += weight * other.weights;
        }
    };

    /// Adds the means of the costs of a block and of its neighbors that were measured.
    void addSmoothed(const PairPilot& pilot, const HugeBuffer<Sets>& blocks, size_t block) {
        Sets sums;
        pilot.forEachNeighbor(block, [&](size_t i, float weight) { sums.add(blocks[i], weight); });
        halves[0].push_back(meanOf(sums, 0));
        halves[1].push_back(meanOf(sums, 1));
        whole.push_back(meanOf(sums, kWhole));
    }
    static BlockCost meanOf(const Sets& sums, int k) {
        BlockCost mean;
        if (sums.weights[k] > 0) {
            const float scale = 1 / sums.weights[k];
            mean.errors = scale * sums.errors[k];
            mean.time = scale * sums.times[k];
        }
        if (mean.errors[kRest] > 0)
            mean.logDensity = std::log2(mean.errors[kRest] / mean.time) / 2;
        return mean;
    }
};

/// Returns the power of two next to a factor, given its binary logarithm.
uint8_t roundedFactor(double exponent) {
    return uint8_t(1u << int(std::clamp(exponent, 0., double(kMaxExponent)) + 0.5));
}

/// The costs of all blocks in bins of their density. At a step, a block of the largest density has a factor
/// of 2^(step / kSteps). One half of the pilot gives the densities, and the other half the errors. Otherwise,
/// noise of the pilot would look like a gain.
class DensityBins {
  public:
    static constexpr int kSteps = 4, kStepCount = 10 * kSteps;

    /// `largest`: the binary logarithm of the largest density.
    DensityBins(const PilotCosts& costs, double largest) {
        for (int half = 0; half < kHalves; ++half)
            for (size_t i = 0; i < costs.whole.size(); ++i) {
                const double density = double(costs.halves[half][i].logDensity) - largest;
                Bin& bin = m_bins[binOf(density)];
                for (int lane = 0; lane < 4; ++lane)
                    bin.errors[lane] += double(costs.halves[1 - half][i].errors[lane]);
                bin.time += double(costs.whole[i].time);
            }
    }
    /// Returns the product of error and time with the factors of a step; a negative step: with factors of 1.
    /// Returns infinity if the time is more than kMaxTime times that of factors of 1, or if the product grows
    /// for radiance that is not clipped: if rare bright samples are elsewhere.
    double productFor(int step) const {
        double error = 0, rawError = 0, time = 0, leastTime = 0, mostRawError = 0;
        for (int i = 0; i < kBins; ++i) {
            const Bin& bin = m_bins[i];
            const double factor = step < 0 ? 1 : 1 << exponentOf(i, step), shared = bin.errors[kShared];
            error += bin.errors[kRest] / factor + shared;
            rawError += bin.errors[kRawRest] / factor + shared;
            time += bin.time * factor;
            leastTime += bin.time;
            mostRawError += bin.errors[kRawRest] + shared;
        }
        const bool isAllowed = time <= kMaxTime * leastTime && rawError * time <= mostRawError * leastTime;
        return isAllowed ? error * time : INFINITY;
    }

  private:
    /// Blocks of the first bin have a factor of 1 at all steps, those of the last bin the largest factor.
    static constexpr int kFirst = -kStepCount, kLast = kSteps * kMaxExponent, kBins = kLast - kFirst + 1;

    /// Sums over blocks.
    struct Bin {
        double errors[4] = {}; ///< by ErrorLane
        double time = 0;
    };

    static size_t binOf(double logDensity) {
        const double bin = std::floor(kSteps * (logDensity + 0.5));
        return size_t(std::clamp(bin, double(kFirst), double(kLast)) - kFirst);
    }
    /// Returns the exponent of roundedFactor for a bin.
    static int exponentOf(int bin, int step) {
        return std::clamp((bin + kFirst + step + kStepCount) / kSteps - kStepCount / kSteps, 0, kMaxExponent);
    }
    Bin m_bins[kBins];
};

/// Returns the binary logarithm of the scale of the densities that leaves about the least product of error
/// and time; none, if that gains less than a factor of minGain.
std::optional<double> findLogScale(const PilotCosts& costs, double minGain) {
    constexpr double kNearlyLeast = 1.03;
    float largest = -INFINITY;
    for (const BlockCost& block : costs.whole)
        largest = std::max(largest, block.logDensity);
    if (largest == -INFINITY)
        return {};
    const DensityBins bins(costs, double(largest));
    std::vector<double> products; // by step
    for (int step = 0; step < DensityBins::kStepCount; ++step)
        products.push_back(bins.productFor(step));
    const double least = *std::min_element(products.begin(), products.end());
    if (least * minGain > bins.productFor(-1))
        return {};
    const auto chosen = std::find_if(products.begin(), products.end(),
                                     [&](double product) { return product <= kNearlyLeast * least; });
    return double(chosen - products.begin()) / DensityBins::kSteps - double(largest);
}

/// Returns the gain in the squared sum of the roots of the errors times the time. In it, blocks count more
/// alike than in the sum of the errors, as in structural errors. Samples are clipped to 1.
double rootGain(const PilotCosts& costs, double logScale) {
    double roots = 0, plannedRoots = 0, time = 0, plannedTime = 0;
    for (const BlockCost& block : costs.whole) {
        const double factor = roundedFactor(logScale + double(block.logDensity));
        const double rest = double(block.errors[kClippedRest]), shared = double(block.errors[kShared]);
        roots += std::sqrt(rest + shared);
        plannedRoots += std::sqrt(rest / factor + shared);
        time += double(block.time);
        plannedTime += double(block.time) * factor;
    }
    return plannedRoots > 0 ? sqr(roots / plannedRoots) * time / plannedTime : 0;
}

/// Returns whether camera rays hit emission brighter than 1.
bool seesLamps(const PairPilot& pilot) {
    for (size_t i = 0; i < pilot.blocks().factors().size(); ++i)
        if (pilot.noise(0, i).brightEmission + pilot.noise(1, i).brightEmission > 0)
            return true;
    return false;
}

bool allowsSamplePlan(double samplesPerPixel) {
    constexpr int kMinSamples = 4; // fewer are not worth the rest of the pilot
    return samplesPerPixel >= kMinSamples &&
           samplesPerPixel * (1 << kMaxExponent) <= PixelAccumulator::kMaxSamples;
}

} // namespace

bool promisesSamplePlan(const PairPilot& pilot, double samplesPerPixel, LightParts shared) {
    if (!allowsSamplePlan(samplesPerPixel))
        return false;
    if (!shared.isEmpty())
        return findLogScale(PilotCosts(pilot, shared), kMinGain).has_value();
    // Where nothing is shared, the pilot is the whole overhead. It ends if its first part promises less than
    // this; few pairs promise less than many. They may hit the edges of a lamp too rarely to promise
    // anything: therefore the noise without emission decides, too.
    constexpr double kLeastPromise = 1.25, kLeastPromiseBesideLamps = 1.45;
    const auto promises = [&](LightParts without, double least) {
        return findLogScale(PilotCosts(pilot, without), least).has_value();
    };
    if (!seesLamps(pilot))
        return promises({}, kLeastPromise);
    return promises({}, kLeastPromiseBesideLamps) || promises(LightParts(1), kLeastPromiseBesideLamps);
}

std::optional<SampleFactors> planSamples(PairPilot& pilot, double samplesPerPixel, LightParts shared) {
    // Where no light is shared, some plans lose (measured):
    // - The edges of lamps have much of the error, and few pairs hit them.
    // - Structural errors grow where few bright blocks have all of the gain.
    constexpr double kMinGainBesideLamps = 1.8, kMinRootGain = 0.95;
    if (!allowsSamplePlan(samplesPerPixel) ||
        (shared.isEmpty() && !promisesSamplePlan(pilot, samplesPerPixel, shared)))
        return {};
    pilot.renderRest();
    const PilotCosts costs(pilot, shared);
    const auto logScale =
        findLogScale(costs, shared.isEmpty() && seesLamps(pilot) ? kMinGainBesideLamps : kMinGain);
    if (!logScale || (shared.isEmpty() && rootGain(costs, *logScale) < kMinRootGain))
        return {};
    SampleFactors out = pilot.blocks();
    for (size_t i = 0; i < costs.whole.size(); ++i)
        out.factors()[i] = roundedFactor(*logScale + double(costs.whole[i].logDensity));
    return out;
}

} // namespace strobe
