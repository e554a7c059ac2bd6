#include "sharing/pilots/verdict.h"

#include <algorithm>
#include <cmath>

namespace strobe {

namespace {

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
    bool isSureOfDirect; ///< another choice of the blocks would hardly add or remove direct light
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
    const BlockSum gain = sumOver(
        pilots, [&](const BlockPilot& pilot) { return costOf(pilot, 0) - least * costOf(pilot, best); });
    return {kSharingChoices[best], gain,
            best == kSharesDirect || !lit.has(LightPart::Direct) || std::abs(ofDirect) >= measured.deviation};
}

} // namespace

Verdict decideSharing(std::span<const BlockPilot> pilots, LightParts lit, const Overheads& overheads,
                      double gainLeft) {
    constexpr double kMargin = 1.2, kStandardErrors = 0.5, kCertain = 1;
    Verdict verdict;
    const auto pays = [&](const SharingGain& of, double standardErrors) {
        // More blocks add direct light alone only where it seems to pay: see Verdict::isCertain.
        const bool isCertain = std::abs(of.gain.sum) >= kCertain * of.gain.deviation ||
                               (of.gain.sum < 0 && !lit.has(LightPart::Indirect));
        if (of.gain.sum > standardErrors * of.gain.deviation) {
            verdict = {of.parts, isCertain && of.isSureOfDirect};
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
    const double least = leastInPilot(kMargin * (1 + overheads.least()));
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
        pays(gain, overheads.adapts ? 0 : kCertain);
    return verdict;
}

} // namespace strobe
