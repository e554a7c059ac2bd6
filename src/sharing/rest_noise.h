// The noise of the light that is not mixed with shared estimates.
#pragma once

#include "sharing/emission/emission_refinement.h"

namespace strobe {

/// Returns, by pixel, the variance of the light of the samples that is neither in `light.parts` nor rare. It
/// is that of the mean of the channels. `corrections`: of the emission, by ascending pixel.
///
/// The emission that camera rays hit has noise at the edges of lamps, which are narrow and may be very
/// bright. Its variance is that of independent samples in each pixel, times a factor by which stratified
/// samples have less: that of the whole image. The variance of parts that are not shared is a mean over a
/// window of pixels. The halves of the samples show both. The covariance between parts and emission is left
/// out.
HugeVector<float> restVariance(const RecordedLight& light, std::span<const PixelCorrection> corrections);

} // namespace strobe
