// More samples in blocks of pixels with much noise.
#pragma once

#include "sharing/pilots/pair_pilot.h"
#include "sharing/pilots/sharing_plan.h"

#include <optional>

namespace strobe {

/// Returns the factors of the numbers of samples, by blocks of pixels; none, if all are 1. The factors are
/// powers of two from 1 on.
///
/// - They leave about the least product of error and time (Neyman allocation), or are 1 if that gains little.
///   It is the geometric mean for the squared error and for the squared sum of the roots of the errors of
///   blocks. The time of the samples grows by a factor of three at most. The variances of blocks, relative to
///   their radiance, are those of all but shared indirect light.
/// - Backgrounds, which cannot gain by sharing, have at least the factor by which the time of the render
///   grows: they are not worse than those of a render of the same time that does not share. They add at most
///   half of its time.
///
/// PairPilot::renderFirst was called. This function renders the rest of the pilot, unless nothing is shared
/// and the first part promises little. The factors do not depend on the seed or on slices of the samples.
/// Therefore they do not bias the result.
std::optional<SampleFactors> planSamples(PairPilot& pilot, double samplesPerPixel,
                                         const SharingPlan& sharing);

/// Returns whether what `pilot` has rendered promises that planSamples returns factors.
bool promisesSamplePlan(const PairPilot& pilot, double samplesPerPixel, const SharingPlan& sharing);

} // namespace strobe
