// Pixels that are much brighter than those around them.
#pragma once

#include "core/math/simd4.h"
#include "sharing/errors/window_mean.h"

#include <span>

namespace strobe {

/// The brightness of the shared light of a pixel.
struct Brightness {
    float mean;  ///< of both halves of the samples
    float least; ///< that of the darker half: a bright sample by chance is in one of them
};

/// Pixels that are much brighter than those around them, as the inside of a lamp or a highlight. In means
/// over windows of pixels, they count less. Squared errors grow with the square of the brightness: a
/// highlight, 30 times as bright as the wall beside it, has a thousand times its squared bias. With a plain
/// mean, the wall would keep the noise of its own values as far as the window reaches: a halo of noise around
/// the highlight.
class BrightPixels {
  public:
    struct Pixel {
        uint32_t index;
        float weight; ///< between 0 and 1: falls with the fourth power of the brightness relative to that
                      ///< around
    };

    /// `brightness`: by pixel.
    BrightPixels(std::span<const Brightness> brightness, int width, int height);

    /// Returns all of them, in ascending order.
    std::span<const Pixel> all() const { return m_pixels; }
    /// Returns 1 for each pixel that is not bright, and 0 for the others.
    std::span<const float> others() const { return m_others; }

  private:
    std::vector<Pixel> m_pixels;
    std::vector<float> m_others; ///< by pixel
};

/// The means of a plane over the windows around bright pixels. All pixels count in these as they are.
class BrightMeans {
  public:
    /// Computes them from the values of the plane.
    BrightMeans(const LanePlane& plane, const WindowMean& window, const BrightPixels& bright);
    /// Lowers the weight of bright pixels in later means: it replaces the rest of their values by the means
    /// of the pixels around them that are not bright.
    void fade(LanePlane& plane) const;
    /// Writes the means to the bright pixels.
    void write(LanePlane& plane) const;

  private:
    struct Means {
        Float4 all, others;
    };
    Means meansAround(const LanePlane& plane, const WindowMean& window, size_t pixel) const;

    const BrightPixels& m_bright;
    std::vector<Means> m_means; ///< by bright pixel
};

} // namespace strobe
