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

Verdict decideSharing(std::span<const BlockPilot> pilots, LightParts lit, double overhead, double gainLeft) {
    constexpr double kOnePart = 0.9; // of the overhead of both parts (measured: 0.86 to 0.92)
    const double time = 1 + overhead / gainLeft, timeOfOne = 1 + kOnePart * overhead / gainLeft;
    const double times[kSharingChoiceCount] = {1, timeOfOne, timeOfOne, time};
    const auto gain = [&](size_t from, size_t to) {
        const auto rootOf = [&](const BlockPilot& pilot, size_t choice) {
            return pilot.weight * std::sqrt(std::max(pilot.errors[choice], 0.) * times[choice]);
        };
        return sumOver(pilots,
                       [&](const BlockPilot& pilot) { return rootOf(pilot, from) - rootOf(pilot, to); });
    };
    if (!lit.has(LightPart::Indirect)) {
        constexpr double kStandardErrors = 0.5;
        const BlockSum ofDirect = gain(0, kSharesDirect);
        return {kSharingChoices[ofDirect.exceeds(kStandardErrors) ? kSharesDirect : 0],
                ofDirect.sum < 0 || ofDirect.exceeds(1)};
    }
    constexpr double kLossOfIndirect = 2, kLossOfDirect = 0.5; // standard errors
    const bool hasDirect =
        lit.has(LightPart::Direct) && gain(kSharesIndirect, kSharesBoth).exceeds(-kLossOfDirect);
    const size_t best = hasDirect ? kSharesBoth : kSharesIndirect;
    const BlockSum ofBest = gain(0, best);
    const bool isShared = ofBest.exceeds(-kLossOfIndirect);
    return {kSharingChoices[isShared ? best : 0], ofBest.sum > 0 || !isShared};
}

} // namespace strobe
