#include "sharing/pilots/sample_plan.h"

#include "sharing/pilots/pilot_costs.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strobe {

namespace {

constexpr int kMaxExponent = 4; ///< of the factors, which are powers of two
/// The largest time of the samples relative to that with factors of 1.
constexpr double kMaxTime = 3;

/// Returns the power of two next to a factor, given its binary logarithm.
uint8_t roundedFactor(double exponent) {
    return uint8_t(1u << int(std::clamp(exponent, 0., double(kMaxExponent)) + 0.5));
}

/// The parts of the planned errors that factors leave, by the exponents of the factors.
using ErrorsLeft = std::array<float, kMaxExponent + 1>;

ErrorsLeft errorsLeft(double samplesPerPixel, bool isShared) {
    // Estimates from few samples are worse, so that the errors of shared light fall faster than in proportion
    // to the samples. Over 34 scenes with 4 and 16 samples, 0 gains less than 2, and 4 as much.
    constexpr double kFewSamples = 2;
    const double few = isShared ? kFewSamples / samplesPerPixel : 0;
    ErrorsLeft out;
    for (int i = 0; i <= kMaxExponent; ++i) {
        const double factor = 1 << i;
        out[size_t(i)] = float((1 + few / factor) / (1 + few) / factor);
    }
    return out;
}

/// Expected products of error and time, relative to those without a plan.
struct Products {
    double errors = INFINITY; ///< of the squared error
    /// Of the squared sum of the roots of the errors of blocks, with samples clipped to 1. In it, blocks
    /// count more alike than in the sum of the errors, as in structural errors.
    double roots = INFINITY;
    double mean() const { return std::sqrt(errors * roots); }
};

Products meanOf(const Products& a, const Products& b) {
    return {std::sqrt(a.errors * b.errors), std::sqrt(a.roots * b.roots)};
}

/// The costs of all blocks in bins of their density. At a step, a block of the largest density, rounded up to
/// a bin, has a factor of 2^(step / kSteps).
class DensityBins {
  public:
    static constexpr int kSteps = 4, kStepCount = 10 * kSteps;

    DensityBins(const PilotCosts& costs, const SharingOverhead& overhead, const ErrorsLeft& errorsLeft)
        : m_overhead(overhead), m_errorsLeft(errorsLeft) {
        std::vector<Bin> bins[kModes];
        for (std::vector<Bin>& ofMode : bins)
            ofMode.resize(kAbsoluteBins);
        float largest = -INFINITY;
        costs.forEachBlock([&](size_t, const PilotCosts::OfBlock& block) {
            const BlockCost& whole = block[PilotCosts::kWhole];
            largest = std::max(largest, whole.logDensity);
            bins[kInSample][absoluteBinOf(whole.logDensity)].add(whole.errors, whole.time, errorsLeft);
            for (int half = 0; half < kHalves; ++half)
                bins[kCrossed][absoluteBinOf(block[half].logDensity)].add(block[1 - half].errors, whole.time,
                                                                          errorsLeft);
        });
        m_largest = std::ceil(kSteps * largest);
        for (int i = 0; m_largest > -INFINITY && i < kAbsoluteBins; ++i) {
            const double bin = double(i + kFirstAbsolute) - double(m_largest);
            const auto to = size_t(std::clamp(bin, double(kFirst), double(kLast)) - kFirst);
            for (int mode = 0; mode < kModes; ++mode)
                m_bins[mode][to].add(bins[mode][size_t(i)]);
        }
    }
    /// Returns whether all densities are 0.
    bool isEmpty() const { return m_largest == -INFINITY; }
    /// Returns the binary logarithm of the scale of the densities at a step.
    double logScaleOf(int step) const { return (double(step) - double(m_largest)) / kSteps; }
    /// Returns the product of squared error and time with the factors of a step, relative to that with
    /// factors of 1, by the mode in which gains are too small.
    double crossedProductFor(int step) const {
        const RelativeCosts costs = costsFor(step, m_bins[kCrossed]);
        return costs.time <= kMaxTime && costs.rawProduct <= 1 ? costs.products.errors : INFINITY;
    }
    /// Returns the products with the factors of a step: the geometric means over the modes. They are infinite
    /// if the samples take more than kMaxTime times as long as with factors of 1, or if the product grows for
    /// radiance that is not clipped: if rare bright samples are elsewhere.
    Products productsFor(int step) const {
        const RelativeCosts crossed = costsFor(step, m_bins[kCrossed]),
                            inSample = costsFor(step, m_bins[kInSample]);
        const bool isAllowed = std::max(crossed.time, inSample.time) <= kMaxTime &&
                               crossed.rawProduct * inSample.rawProduct <= 1;
        return isAllowed ? meanOf(crossed.products, inSample.products) : Products();
    }

  private:
    /// How the pilot gives the densities and the errors. The gain of a plan is between those of both modes.
    enum Mode {
        kCrossed,  ///< one half the densities, the other half the errors: few pairs gain less than all
        kInSample, ///< the whole pilot both: its noise looks like a gain
        kModes
    };
    /// Blocks of the first bin have a factor of 1 at all steps, those of the last bin the largest factor.
    static constexpr int kFirst = -kStepCount, kLast = kSteps * kMaxExponent, kBins = kLast - kFirst + 1;
    /// Bins of densities that are not relative to the largest: from 2^-64 to 2^64.
    static constexpr int kFirstAbsolute = -64 * kSteps, kAbsoluteBins = 128 * kSteps;

    /// Sums over blocks.
    struct Bin {
        double errors[4] = {}; ///< by ErrorLane
        double time = 0;
        double roots[kMaxExponent + 1] = {}; ///< of the errors, by the exponent of the factor
        void add(const Float4& ofBlock, float timeOfBlock, const ErrorsLeft& errorsLeft) {
            for (int lane = 0; lane < 4; ++lane)
                errors[lane] += double(ofBlock[lane]);
            time += double(timeOfBlock);
            for (size_t i = 0; i < errorsLeft.size(); ++i)
                roots[i] += double(std::sqrt(errorsLeft[i] * ofBlock[kClippedPlanned] + ofBlock[kOther]));
        }
        void add(const Bin& other) {
            for (int lane = 0; lane < 4; ++lane)
                errors[lane] += other.errors[lane];
            time += other.time;
            for (int i = 0; i <= kMaxExponent; ++i)
                roots[i] += other.roots[i];
        }
    };
    using Bins = Bin[kBins];

    /// Costs relative to those with factors of 1.
    struct RelativeCosts {
        double time; ///< of the samples
        Products products;
        double rawProduct; ///< of the squared error of radiance that is not clipped, and time
    };
    RelativeCosts costsFor(int step, const Bins& bins) const {
        double error = 0, rawError = 0, roots = 0, time = 0;
        double mostError = 0, mostRawError = 0, mostRoots = 0, leastTime = 0;
        for (int i = 0; i < kBins; ++i) {
            const Bin& bin = bins[i];
            const int exponent = exponentOf(i, step);
            const double left = double(m_errorsLeft[size_t(exponent)]), other = bin.errors[kOther];
            error += left * bin.errors[kPlanned] + other;
            rawError += left * bin.errors[kRawPlanned] + other;
            roots += bin.roots[exponent];
            time += bin.time * (1 << exponent);
            mostError += bin.errors[kPlanned] + other;
            mostRawError += bin.errors[kRawPlanned] + other;
            mostRoots += bin.roots[0];
            leastTime += bin.time;
        }
        const double ofSamples = time / leastTime,
                     ofRender = m_overhead.timeOf(ofSamples) / m_overhead.timeOf(1);
        const double rootRatio = mostRoots > 0 ? roots / mostRoots : 1;
        return {ofSamples,
                {ofRender * error / mostError, ofRender * sqr(rootRatio)},
                ofRender * rawError / mostRawError};
    }
    static size_t absoluteBinOf(float logDensity) {
        const float bin = std::floor(kSteps * (logDensity + 0.5f));
        return size_t(std::clamp(bin - kFirstAbsolute, 0.f, float(kAbsoluteBins - 1)));
    }
    /// Returns the exponent of roundedFactor for a bin.
    static int exponentOf(int bin, int step) {
        return std::clamp((bin + kFirst + step + kStepCount) / kSteps - kStepCount / kSteps, 0, kMaxExponent);
    }
    const SharingOverhead m_overhead;
    const ErrorsLeft m_errorsLeft;
    Bins m_bins[kModes];
    float m_largest; ///< binary logarithm of the largest density, in steps, rounded up
};

/// Returns the factor of a block for a scale of the densities, given its binary logarithm.
uint8_t factorOf(const BlockCost& block, double logScale) {
    return roundedFactor(logScale + double(block.logDensity));
}

/// Returns the binary logarithm of the scale of the densities that leaves about the least mean product; none,
/// if squared errors are expected to gain less than kMinGain. Where light is shared, half of the pairs must
/// promise a gain, too: the noise of all of them looks like one. Where nothing is shared, the roots of the
/// errors must gain: structural errors grow if few bright blocks have all of the gain (measured).
std::optional<double> findLogScale(const PilotCosts& costs, double samplesPerPixel,
                                   const SharingPlan& sharing) {
    constexpr double kNearlyLeast = 1.03, kMinGain = 1.3, kMinRootGain = 1.1, kMinCrossedGain = 1.15;
    const bool isShared = !sharing.parts.isEmpty();
    const DensityBins bins(costs, sharing.overhead, errorsLeft(samplesPerPixel, isShared));
    if (bins.isEmpty())
        return {};
    std::vector<Products> products; // by step
    double least = INFINITY, leastCrossed = INFINITY;
    for (int step = 0; step < DensityBins::kStepCount; ++step) {
        products.push_back(bins.productsFor(step));
        least = std::min(least, products.back().mean());
        leastCrossed = std::min(leastCrossed, bins.crossedProductFor(step));
    }
    const auto chosen = std::find_if(products.begin(), products.end(), [&](const Products& product) {
        return product.mean() <= kNearlyLeast * least;
    });
    const bool isSure = isShared ? leastCrossed * kMinCrossedGain <= 1 : chosen->roots * kMinRootGain <= 1;
    if (!isSure || chosen->errors * kMinGain > 1)
        return {};
    return bins.logScaleOf(int(chosen - products.begin()));
}

/// The noisy blocks in which no camera ray of the pilot hits anything, and their time.
struct Backgrounds {
    std::vector<size_t> blocks;
    double time = 0; ///< with factors of 1

    void add(const PairPilot& pilot, size_t block, float timeOfBlock) {
        const BlockNoise &a = pilot.noise(0, block), &b = pilot.noise(1, block);
        const bool isNoisy = a.all.raw + b.all.raw > 0; // implies that the block was rendered
        if (!isNoisy || a.cameraHits + b.cameraHits > 0)
            return;
        blocks.push_back(block);
        time += double(timeOfBlock);
    }
    /// Raises their factors to at least that by which the time of the render grows, but by no more than adds
    /// half of it: in an image of backgrounds alone, the factor would grow with its own time. `renderTime`:
    /// relative to that of a render without sharing in which all factors are 1, which takes `leastTime`.
    void raise(double renderTime, double leastTime, SampleFactors& out) const {
        constexpr double kMostAdded = 0.5;
        uint8_t least = roundedFactor(std::ceil(std::log2(renderTime)));
        while (least > 1 && time * (least - 1) > kMostAdded * renderTime * leastTime)
            least /= 2;
        for (const size_t block : blocks)
            out.factors()[block] = std::max(out.factors()[block], least);
    }
};

/// All but the light that sharing or EmissionRefinement improve.
PlannedLight lightLeftBy(const SharingPlan& sharing) {
    // Sharing leaves about this part of the variance of indirect light. It hardly depends on the number of
    // samples, while that of direct light falls with it, shared or not (measured).
    constexpr float kSharedNoise = 0.03f;
    if (sharing.parts.has(LightPart::Indirect))
        return {&BlockNoise::direct, kSharedNoise};
    const bool leavesEmission = !sharing.parts.isEmpty() || sharing.emission;
    return {leavesEmission ? &BlockNoise::vertex : &BlockNoise::all, kSharedNoise};
}

/// Returns findLogScale for the light that sharing leaves. Where indirect light is not shared, the plan must
/// also gain if its noise stays: few pairs hit the rare bright samples that may have most of it.
std::optional<double> findLogScale(const PilotCosts& costs, const PairPilot& pilot, double samplesPerPixel,
                                   const SharingPlan& sharing) {
    const auto logScale = findLogScale(costs, samplesPerPixel, sharing);
    const bool leavesIndirect =
        !sharing.parts.has(LightPart::Indirect) && pilot.brightness().litParts().has(LightPart::Indirect);
    if (leavesIndirect &&
        !findLogScale(PilotCosts(pilot, {&BlockNoise::direct, 1}), samplesPerPixel, sharing))
        return {};
    return logScale;
}

bool allowsSamplePlan(double samplesPerPixel) {
    constexpr int kMinSamples = 2; // both halves of a pixel need one
    return samplesPerPixel >= kMinSamples &&
           samplesPerPixel * (1 << kMaxExponent) <= PixelAccumulator::kMaxSamples;
}

} // namespace

bool promisesSamplePlan(const PairPilot& pilot, double samplesPerPixel, const SharingPlan& sharing) {
    return allowsSamplePlan(samplesPerPixel) &&
           findLogScale(PilotCosts(pilot, lightLeftBy(sharing)), pilot, samplesPerPixel, sharing);
}

std::optional<SampleFactors> planSamples(PairPilot& pilot, double samplesPerPixel,
                                         const SharingPlan& sharing) {
    const bool isShared = !sharing.parts.isEmpty();
    if (!allowsSamplePlan(samplesPerPixel) ||
        (!isShared && !promisesSamplePlan(pilot, samplesPerPixel, sharing)))
        return {};
    pilot.renderRest();
    const PilotCosts costs(pilot, lightLeftBy(sharing));
    const auto logScale = findLogScale(costs, pilot, samplesPerPixel, sharing);
    if (!isShared && !logScale)
        return {};
    SampleFactors out = pilot.blocks();
    Backgrounds backgrounds;
    double time = 0, leastTime = 0;
    costs.forEachBlock([&](size_t i, const PilotCosts::OfBlock& block) {
        const BlockCost& whole = block[PilotCosts::kWhole];
        if (logScale)
            out.factors()[i] = factorOf(whole, *logScale);
        leastTime += double(whole.time);
        time += double(whole.time) * out.factors()[i];
        backgrounds.add(pilot, i, whole.time);
    });
    if (leastTime > 0)
        backgrounds.raise(sharing.overhead.timeOf(time / leastTime), leastTime, out);
    if (std::all_of(out.factors().begin(), out.factors().end(), [](uint8_t factor) { return factor == 1; }))
        return {};
    return out;
}

} // namespace strobe
