// More samples in blocks of pixels with much noise.
#pragma once

#include "core/render/integrator.h"
#include "sharing/records/light_units.h"

#include <optional>

namespace strobe {

/// Returns the factors of the numbers of samples, by blocks of pixels, that minimize the product of error and
/// time (Neyman allocation); none, if that gains little. The factors are powers of two from 1 on, and at most
/// double the time of the render. A pilot of about 2 % of the samples measures the variances of blocks,
/// relative to their radiance, of all but shared indirect light.
///
/// The factors depend on the scene, on context.pilotBounds and on the number of samples, but not on the seed
/// or on slices of the samples. Therefore they do not bias the result.
std::optional<SampleFactors> planSamples(const Scene& scene, const RenderContext& context, LightParts shared);

} // namespace strobe
