// The noise of the light that is not mixed with shared estimates.
#pragma once

#include "sharing/emission/emission_refinement.h"

namespace strobe {

/// Returns, by pixel, the variance of the light of the samples that is neither in `light.parts` nor rare: of
/// the emission that camera rays hit, and of parts that are not shared. It is that of the mean of the
/// channels, averaged over windows of pixels. The halves of the samples show it; its covariance with the
/// other light is left out. `corrections`: of the emission, by ascending pixel.
HugeVector<float> restVariance(const RecordedLight& light, std::span<const PixelCorrection> corrections);

} // namespace strobe
