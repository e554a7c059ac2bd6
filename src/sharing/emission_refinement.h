// More visibility samples where the light that camera rays hit directly is noisy: at the edges of lamps.
#pragma once

#include "core/render/integrator.h"
#include "sharing/recorded_light.h"

namespace strobe {

/// Returns the correction of each pixel, to be added to the mean of its samples. The emission
/// (FirstVertex::emitted) is a control variate: the correction is the difference between the mean emission of
/// additional camera samples and that of the recorded ones, times the regression coefficient of the radiance
/// on the emission. The coefficient is 1 for a bright lamp, and 0 for a background that is as bright as the
/// objects in front of it.
///
/// The coefficient and the number of samples for one half of a pixel depend on the other half and on the
/// eight neighbors only, so that the choice does not bias the result. `otherError`: the squared error that
/// emission does not cause, summed over pixels; mean of the channels.
std::vector<Rgb> emissionCorrection(const Scene& scene, const CameraSampling& sampling,
                                    const RecordedLight& light, double otherError);

} // namespace strobe
