#include "sharing/pilots/sample_plan.h"

#include <algorithm>
#include <array>
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

/// The squared errors and the time of pixels per sample.
template <class Real>
struct Costs {
    Real error = 0;        ///< of all but shared indirect light; clipped
    Real rawError = 0;     ///< not clipped
    Real clippedError = 0; ///< of samples clipped to 1
    Real shared = 0;       ///< of shared indirect light
    Real time = 0;         ///< 0: not measured
    template <class Other>
    void add(const Costs<Other>& other, Real weight) {
        error += weight * Real(other.error);
        rawError += weight * Real(other.rawError);
        clippedError += weight * Real(other.clippedError);
        shared += weight * Real(other.shared);
        time += weight * Real(other.time);
    }
};

/// Returns the cost of a block that has the samples of both `a` and `b`. `rays`: of a sample with a first
/// vertex.
Costs<float> costOf(const BlockNoise& a, const BlockNoise& b, float rays, LightParts shared) {
    constexpr float kDark = 0.1f;
    const float pairs = a.pairs + b.pairs, samples = kPair * pairs;
    if (pairs == 0)
        return {};
    const float vertices = (a.vertices + b.vertices) / samples;
    const float weight = 1 / (pairs * ((a.radiance + b.radiance) / samples + kDark));
    Costs<float> cost;
    const BlockNoise::Split &ofA = a.with(shared), &ofB = b.with(shared);
    cost.error = weight * (ofA.rest + ofB.rest);
    cost.rawError = weight * (ofA.rawRest + ofB.rawRest);
    cost.clippedError = weight * (ofA.clippedRest + ofB.clippedRest);
    cost.shared = weight * (ofA.shared + ofB.shared);
    cost.time = kMissTime * (1 - vertices) + rays * vertices;
    return cost;
}

/// The costs of a block by each half of the pilot, then by the whole.
using CostSet = std::array<Costs<float>, kHalves + 1>;

/// The costs of a block and its neighbors, with its density.
struct BlockCost : Costs<float> {
    /// The binary logarithm of the density of samples, the root of the error over the time (Neyman
    /// allocation); -infinity without an error.
    float logDensity = -INFINITY;
};

/// The costs of all blocks: by each half of the pilot, and by the whole.
struct PilotCosts {
    std::vector<BlockCost> halves[kHalves], whole;

    PilotCosts(const PairPilot& pilot, LightParts shared) {
        const size_t count = pilot.blocks().factors().size();
        std::vector<CostSet> sets;
        sets.reserve(count);
        for (size_t i = 0; i < count; ++i) {
            const BlockNoise &a = pilot.noise(0, i), &b = pilot.noise(1, i);
            const float rays = pilot.rays(i);
            sets.push_back(
                {costOf(a, {}, rays, shared), costOf({}, b, rays, shared), costOf(a, b, rays, shared)});
        }
        for (std::vector<BlockCost>* costs : {&halves[0], &halves[1], &whole})
            costs->reserve(count);
        for (size_t i = 0; i < count; ++i)
            addSmoothed(pilot, sets, i);
    }

  private:
    /// Adds the means of the costs of a block and of its neighbors that were measured.
    void addSmoothed(const PairPilot& pilot, const std::vector<CostSet>& sets, size_t block) {
        CostSet sums;
        std::array<float, kHalves + 1> weights = {};
        pilot.forEachNeighbor(block, [&](size_t i, float weight) {
            for (size_t k = 0; k < sums.size(); ++k)
                if (sets[i][k].time > 0) {
                    sums[k].add(sets[i][k], weight);
                    weights[k] += weight;
                }
        });
        halves[0].push_back(meanOf(sums[0], weights[0]));
        halves[1].push_back(meanOf(sums[1], weights[1]));
        whole.push_back(meanOf(sums[2], weights[2]));
    }
    static BlockCost meanOf(const Costs<float>& sum, float weight) {
        BlockCost mean;
        if (weight > 0)
            mean.add(sum, 1 / weight);
        if (mean.error > 0)
            mean.logDensity = std::log2(mean.error / mean.time) / 2;
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
                BlockCost cost = costs.halves[1 - half][i];
                cost.time = costs.whole[i].time;
                m_bins[binOf(density)].add(cost, 1);
            }
    }
    /// Returns the product of error and time with the factors of a step; a negative step: with factors of 1.
    /// Returns infinity if the time is more than kMaxTime times that of factors of 1, or if the product grows
    /// for radiance that is not clipped: if rare bright samples are elsewhere.
    double productFor(int step) const {
        double error = 0, rawError = 0, time = 0, leastTime = 0, mostRawError = 0;
        for (int i = 0; i < kBins; ++i) {
            const Costs<double>& bin = m_bins[i];
            const double factor = step < 0 ? 1 : 1 << exponentOf(i, step);
            error += bin.error / factor + bin.shared;
            rawError += bin.rawError / factor + bin.shared;
            time += bin.time * factor;
            leastTime += bin.time;
            mostRawError += bin.rawError + bin.shared;
        }
        const bool isAllowed = time <= kMaxTime * leastTime && rawError * time <= mostRawError * leastTime;
        return isAllowed ? error * time : INFINITY;
    }

  private:
    /// Blocks of the first bin have a factor of 1 at all steps, those of the last bin the largest factor.
    static constexpr int kFirst = -kStepCount, kLast = kSteps * kMaxExponent, kBins = kLast - kFirst + 1;

    static size_t binOf(double logDensity) {
        const double bin = std::floor(kSteps * (logDensity + 0.5));
        return size_t(std::clamp(bin, double(kFirst), double(kLast)) - kFirst);
    }
    /// Returns the exponent of roundedFactor for a bin.
    static int exponentOf(int bin, int step) {
        return std::clamp((bin + kFirst + step + kStepCount) / kSteps - kStepCount / kSteps, 0, kMaxExponent);
    }
    Costs<double> m_bins[kBins];
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
        roots += std::sqrt(double(block.clippedError + block.shared));
        plannedRoots += std::sqrt(double(block.clippedError) / factor + double(block.shared));
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
