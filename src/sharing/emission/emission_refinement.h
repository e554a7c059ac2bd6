// More visibility samples where the light that camera rays hit directly is noisy: at the edges of lamps.
#pragma once

#include "core/render/integrator.h"
#include "sharing/records/recorded_light.h"

namespace strobe {

struct EmissionMoments;
class VisibleEmission;

/// A pilot's estimates of the noise of a render. EmissionRefinement plans with them. Emission is
/// FirstVertex::emitted.
struct EmissionPilot {
    /// Mean squared error of the pixels without that of emission; mean of the channels.
    double otherError = 0;
    /// See emissionCoefficient.
    double coefficient = 1;
    /// The least gain for which camera samples are added: error times time without them, over that with them.
    double minGain = 1.05;
};

/// Plans additional camera samples of pixels, and traces them. The plan depends on the seed and on the pixel
/// bounds, but not on the samples of the render. Therefore it does not bias the result.
class EmissionRefinement {
  public:
    /// Traces one to eight camera samples per pixel of the bounds, to measure the noise of emission.
    EmissionRefinement(const Scene& scene, const CameraSampling& sampling, const PixelBounds& bounds,
                       int samplesPerPixel, const EmissionPilot& pilot);
    /// Returns whether no pixel has samples.
    bool isEmpty() const { return m_samples.empty(); }
    /// Returns whether the plan has samples for the pixel or one of its neighbors.
    bool isNear(const PixelRef& pixel) const;
    /// Returns whether the plan has samples for the pixel.
    bool refines(const PixelRef& pixel) const { return samplesOf(pixel) > 0; }
    /// Traces the samples of a pixel and returns the sum of their emission. `pixel.domain` distinguishes
    /// passes.
    PixelAccumulator trace(const PixelRef& pixel) const;

  private:
    bool contains(const PixelRef& pixel) const;
    size_t indexOf(const PixelRef& pixel) const;
    uint32_t samplesOf(const PixelRef& pixel) const;
    void markNeighbors();
    HugeVector<float> findDeviations(int samplesPerPixel) const;
    using MomentsOfRow = std::vector<EmissionMoments>;
    MomentsOfRow probeRow(int row, uint32_t probes, const VisibleEmission& visible) const;

    const Scene& m_scene;
    const CameraSampling m_sampling;
    const PixelBounds m_bounds;
    // By pixel, row by row; empty if no pixel has samples:
    HugeVector<uint32_t> m_samples;
    std::vector<bool> m_isNear;
};

/// Returns the mean regression coefficient of the radiance on the emission of recorded light, weighted by the
/// noise of the emission; 1 without noise.
double emissionCoefficient(const RecordedLight& light);

/// Returns the emission that the camera ray of a sample hits.
Rgb emissionOf(const Scene& scene, const VisibilitySample& sample);

/// A color to be added to the mean of the samples of a pixel.
struct PixelCorrection {
    size_t pixel; ///< row by row
    Rgb value;
    float replaced; ///< of the emission of the samples: in [0,1]
};

/// Returns the corrections of the pixels in RecordedLight::refined, by ascending pixel. The emission is a
/// control variate: the correction is the difference between the mean emission of RecordedLight::refined and
/// that of the samples, times the regression coefficient of the radiance on the emission. The coefficient is
/// 1 for a bright lamp, and 0 for a background that is as bright as the objects in front of it. The
/// coefficient of one half of a pixel depends on the other half and on the eight neighbors only. Therefore it
/// does not bias the result.
std::vector<PixelCorrection> emissionCorrections(const RecordedLight& light);

} // namespace strobe
