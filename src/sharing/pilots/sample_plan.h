// More samples in blocks of pixels with much noise.
#pragma once

#include "sharing/pilots/pair_pilot.h"

#include <optional>

namespace strobe {

/// Returns the factors of the numbers of samples, by blocks of pixels, that minimize the product of error and
/// time (Neyman allocation); none, if that gains little. The factors are powers of two from 1 on, and at most
/// double the time of the render. The variances of blocks, relative to their radiance, are those of all but
/// shared indirect light. PairPilot::renderFirst was called. This function renders the
/// rest of the pilot, unless nothing is shared and the first part promises little.
///
/// The factors do not depend on the seed or on slices of the samples. Therefore they do not bias the result.
std::optional<SampleFactors> planSamples(PairPilot& pilot, double samplesPerPixel, LightParts shared);

/// Returns whether what `pilot` has rendered promises that planSamples returns factors.
bool promisesSamplePlan(const PairPilot& pilot, double samplesPerPixel, LightParts shared);

} // namespace strobe
