#include "sharing/pilots/verdict.h"

#include <algorithm>
#include <cmath>

namespace strobe {

namespace {

/// A sum over the pilot's blocks.
struct BlockSum {
    double sum = 0, deviation = 0; ///< and its standard error
    bool exceeds(double standardErrors) const { return sum > standardErrors * deviation; }
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

} // namespace

Verdict decideSharing(std::span<const BlockPilot> pilots, const PilotedLight& light, double overhead,
                      double sampleRatio) {
    constexpr double kMuchIndirect = 1.2;
    const bool isLikely = light.gainWithoutIndirect > kMuchIndirect;
    // The gain above 1 falls with this power of the number of samples, as bias does not fall with it. From 64
    // to 4096 samples, that of indirect light has a power of 0.45 to 0.9 (moving-pair,
    // anim-moving-reflection). The noise of direct light falls faster: of what blocks with 64 samples show,
    // renders of direct light alone with 256 have less than a fifth (five of six scenes).
    constexpr double kPowerOfIndirect = 0.6, kPowerOfDirect = 3;
    const bool hasIndirect = light.lit.has(LightPart::Indirect);
    const double gainLeft = std::pow(sampleRatio, hasIndirect ? kPowerOfIndirect : kPowerOfDirect);
    constexpr double kOnePart = 0.9; // of the overhead of both parts (measured: 0.86 to 0.92)
    const double time = 1 + overhead / gainLeft, timeOfOne = 1 + kOnePart * overhead / gainLeft;
    const double times[kSharingChoiceCount] = {1, timeOfOne, timeOfOne, time};
    const auto cost = [&](const BlockPilot& pilot, size_t choice) {
        return pilot.errors[choice] * times[choice];
    };
    const auto gainOfRoots = [&](size_t from, size_t to) {
        return sumOver(pilots, [&](const BlockPilot& pilot) {
            return pilot.weight * (std::sqrt(cost(pilot, from)) - std::sqrt(cost(pilot, to)));
        });
    };
    // Standard errors:
    constexpr double kLeastGain = 1, kLeastGainOfErrors = 0.5, kLossOfDirect = 0.5, kLossOfIndirect = 2;
    size_t best = kSharesDirect;
    if (hasIndirect) {
        const bool hasDirect = light.lit.has(LightPart::Direct) &&
                               gainOfRoots(kSharesIndirect, kSharesBoth).exceeds(-kLossOfDirect);
        best = hasDirect ? kSharesBoth : kSharesIndirect;
    }
    const BlockSum roots = gainOfRoots(0, best);
    if (isLikely) {
        const bool isShared = roots.exceeds(-kLossOfIndirect);
        return {kSharingChoices[isShared ? best : 0], roots.sum > 0 || !isShared};
    }
    const BlockSum errors = sumOver(
        pilots, [&](const BlockPilot& pilot) { return pilot.weight * (cost(pilot, 0) - cost(pilot, best)); });
    const bool isShared = roots.exceeds(kLeastGain) && errors.exceeds(kLeastGainOfErrors);
    return {kSharingChoices[isShared ? best : 0], roots.sum < 0 || roots.exceeds(kLeastGain)};
}

} // namespace strobe
