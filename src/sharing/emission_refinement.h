// More visibility samples where the light that camera rays hit directly is noisy: at the edges of lamps.
#pragma once

#include "core/render/integrator.h"
#include "sharing/recorded_light.h"

namespace strobe {

/// What a pilot found out about the noise of emission (FirstVertex::emitted).
struct EmissionPilot {
    double otherError = 0;  ///< squared error of a pixel that emission does not cause; mean of the channels
    double coefficient = 1; ///< of the regression of the radiance on the emission, weighted by the noise
};

/// Chooses how many more camera samples the pixels take, and traces them. They depend on the seed and on the
/// pixel bounds, but not on the samples of the render: the choice does not bias the result.
class EmissionRefinement {
  public:
    /// A few camera samples per pixel of the bounds find out where emission is noisy.
    EmissionRefinement(const Scene& scene, const CameraSampling& sampling, const PixelBounds& bounds,
                       int samplesPerPixel, const EmissionPilot& pilot);
    /// Returns whether the pixel takes more samples.
    bool refines(const PixelRef& pixel) const { return samplesOf(pixel) > 0; }
    /// Returns the emission that these samples find. `pixel` belongs to a render of any seed.
    PixelAccumulator trace(const PixelRef& pixel) const;

  private:
    uint32_t samplesOf(const PixelRef& pixel) const;
    std::vector<float> findDeviations(int samplesPerPixel) const;
    void probeRow(int row, uint32_t probes, struct EmissionMoments* out) const;

    const Scene& m_scene;
    const CameraSampling m_sampling;
    const PixelBounds m_bounds;
    std::vector<uint32_t> m_samples; ///< by pixel, row by row; empty: none
};

/// Returns the mean noise of the emission in the recorded light, and how much of it is in the radiance.
EmissionPilot emissionPilot(const RecordedLight& light);

/// Returns the correction of each pixel, to be added to the mean of its samples. The emission is a control
/// variate: the correction is the difference between the mean emission of RecordedLight::emission and that of
/// the samples, times the regression coefficient of the radiance on the emission. The coefficient is 1 for a
/// bright lamp, and 0 for a background that is as bright as the objects in front of it. That for one half of
/// a pixel depends on the other half and on the eight neighbors only, so that it does not bias the result.
std::vector<Rgb> emissionCorrection(const RecordedLight& light);

} // namespace strobe
