// Reconstruction of light from the recorded samples.
#pragma once

#include "sharing/records/recorded_light.h"

#include <memory>

namespace strobe {

/// How a part of the light of a pixel was shared.
struct PixelSharing {
    float weight; ///< of shared estimates, in [0,1]
    float width;  ///< mean width of their regions in cells
    // Estimated squared errors, means of the channels:
    float variance;    ///< by which the part is mixed: too much where own samples are stratified
    float ownVariance; ///< of the pixel's own estimate
    float error;       ///< of the mixture with rare light
};

/// The reconstruction of one part of the light of an image, by pixel.
struct SharedPart {
    HugeVector<Rgb> correction; ///< to be added to the mean of the samples; its sum is 0
    HugeBuffer<PixelSharing> pixels;
};

/// Mixes each pixel's own estimate of a part of the light with shared estimates. The correction is the
/// weighted sum of the differences between these and its own.
class LightSharing {
  public:
    explicit LightSharing(RecordedLight light);
    ~LightSharing();
    /// Returns the reconstruction of a part, and frees the part's light. Call once at most for each part that
    /// was recorded.
    SharedPart share(LightPart part);

  private:
    struct Data;
    const std::unique_ptr<Data> m_data;
};

} // namespace strobe
