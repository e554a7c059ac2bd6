// Estimation of the noise of an image that is rendered in passes.
#pragma once

#include "core/image/image.h"
#include "core/math/api.h"

#include <span>
#include <vector>

namespace STROBE_API strobe {

/// Estimates the noise of the mean of passes from the variance between passes. Passes cover the same pixels,
/// are independent and identically distributed: seeds of their own, equally many samples. Correlation within
/// a pass (stratified samples, shared shades) is thereby fully accounted for; a bias common to all passes
/// cannot be detected.
class NoiseEstimate {
  public:
    void add(const Image& pass);
    int passes() const { return m_passes; }

    /// Returns the noise of each pixel: the half-width of the 95 % confidence interval of its luminance Y by
    /// Student's t distribution, divided by max(Y, kFloor). If a pixel's variance is below its 3×3 mean, the
    /// mean is used, so that missed rare light does not read as zero noise. Infinite before the second pass.
    std::vector<float> pixels() const;
    /// Returns the variance of each pixel's luminance in the mean of the passes. Infinite before the second
    /// pass.
    std::vector<float> variances() const;
    /// Returns the noise level: the noise that the fraction kPixelFraction of the pixels does not exceed.
    double level() const;

    static constexpr double kConfidence = 0.95;
    static constexpr double kPixelFraction = 0.95;
    /// Below this luminance (display white is 1), noise is absolute instead of relative.
    static constexpr float kFloor = 0.1f;

  private:
    int m_width = 0, m_height = 0, m_passes = 0;
    std::vector<float> m_mean;              ///< of each pixel's luminance
    std::vector<float> m_squaredDeviations; ///< from the mean, summed over the passes
};

/// Returns the noise level of an image whose pixels have these standard errors, row by row: that of
/// NoiseEstimate::level with the quantile of the normal distribution.
double noiseLevel(const Image& image, std::span<const float> errors);

/// Returns the t for which P(|T| < t) = probability, where T has Student's t distribution with `dof` >= 1
/// degrees of freedom.
double studentQuantile(double probability, int dof);

} // namespace strobe
