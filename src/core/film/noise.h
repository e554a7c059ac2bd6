// How far a picture made in passes may be from what it converges to, as its passes tell.
#pragma once

#include "core/image/image.h"

#include <vector>

namespace strobe {

/// Gathers passes over the same window that are independent of one another and of one distribution: with
/// seeds of their own and equally many samples. What repeats within a pass (points of a sequence, shades that
/// samples share) then shows in how passes differ, and is counted in full; a bias that all passes have is not
/// seen.
class NoiseEstimate {
  public:
    void add(const Image& pass);
    int passes() const { return m_passes; }

    /// Half the width of the 95 % confidence interval of the pixel's luminance Y, over max(Y, kFloor): by
    /// Student's distribution from the variance of the passes. (Of a pixel that all passes agree on, or
    /// nearly, the mean variance around it counts: what it has not met yet, its neighbors have.) Infinite
    /// before the second pass.
    std::vector<float> pixels() const;
    /// The variance of the pixel's luminance as the mean of the passes. Infinite before the second pass.
    std::vector<float> variances() const;
    /// The noise that `kPart` of the pixels do not exceed.
    double level() const;

    static constexpr double kConfidence = 0.95, kPart = 0.95;
    /// Below this luminance (of a display's white), errors count as they are, not relatively.
    static constexpr float kFloor = 0.1f;

  private:
    int m_width = 0, m_height = 0, m_passes = 0;
    std::vector<float> m_mean, m_squares; ///< of luminance; squared deviations from the mean, added up
};

/// The t that |T| does not exceed with this probability, T of Student's distribution with `dof` >= 1 degrees
/// of freedom.
double studentQuantile(double probability, int dof);

} // namespace strobe
