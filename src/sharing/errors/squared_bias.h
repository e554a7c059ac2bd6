// The squared bias of shared light, from noisy pixels.
#pragma once

#include "sharing/errors/bright_pixels.h"

namespace strobe {

/// Estimates of squared bias: means over a window of pixels of products whose expected value is the squared
/// bias. Where rare bright samples meet in both halves of a pixel, its product is many times larger than
/// that. With the mean, all pixels of the window would keep the noise of their own values: a mark on a wall.
/// Therefore, where the mean is not significant, the mean over a window four times as wide takes its place.
/// An image has a thousand windows, so that chance makes some of them significant. Real bias, as of an edge
/// of a shadow, is seldom alone: where that over the wide window is not significant, either, the narrow one
/// must be more so. Bright pixels have the mean over all pixels of the window, and count less in those of
/// others.
class SquaredBias {
  public:
    /// `sigma`: the standard deviation of the window in pixels.
    SquaredBias(int width, int height, float sigma);
    /// Sets the products of a pixel and their expected squared errors. The errors of pixels are independent.
    void set(size_t pixel, const Float4& products, const Float4& squaredErrors) {
        storeFloat4(m_means.at(pixel), products);
        storeFloat4(m_squaredErrors.at(pixel), squaredErrors);
    }
    /// Replaces the products by means. Call once, after `set` for all pixels. `scratch` has a value per
    /// pixel.
    void average(const BrightPixels& bright, LanePlane& scratch);
    /// Returns the estimates at a pixel. Lanes whose errors are 0 have the means over the narrow window.
    Float4 at(size_t pixel) const { return estimate(pixel, 1); }

  private:
    static constexpr int kCoarse = 4; ///< pixels per edge of a block of m_wideMeans
    Float4 estimate(size_t pixel, float scaleOfWide) const;
    void averageWide(float sigmaOfSquares);
    void averageBlocks();
    void limitBlocks(LanePlane& scratch);
    Float4 interpolate(const LanePlane& plane, size_t pixel) const;

    const float m_sigma;
    LanePlane m_means, m_squaredErrors;
    LanePlane m_wideMeans, m_wideSquaredErrors; ///< by block of pixels
};

} // namespace strobe
