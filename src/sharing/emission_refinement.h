// More visibility samples where the light that camera rays hit directly is noisy: at the edges of lamps.
#pragma once

#include "sharing/light_recorder.h"

namespace strobe {

/// Returns, for each pixel, what is to be added to the mean of its samples: the difference between the mean
/// emission (FirstVertex::emitted) of more camera samples and that of the recorded ones, times a coefficient.
/// The emission is a control variate; the coefficient is its regression coefficient, 1 for a bright lamp and
/// 0 where what is in front of the background is as bright.
///
/// The coefficient and the number of samples for one half of a pixel depend on the other half and on the
/// eight neighbors only, so that the choice does not bias the result. `otherError`: the squared error that
/// emission does not cause, summed over pixels; mean of the channels.
std::vector<Rgb> emissionCorrection(const Scene& scene, const CameraSampling& sampling,
                                    const RecordedLight& light, double otherError);

} // namespace strobe
