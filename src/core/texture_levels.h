// The MIP levels of a small image in memory, looked up by footprint.
#pragma once

#include "core/image.h"

namespace strobe {

/// A lookup as OpenImageIO's texture system makes it (bilinear in two levels, several times along the major
/// axis of the footprint), without its tiles, locks and conversions. What is rare is left to OpenImageIO.
class TextureLevels {
  public:
    /// `levels`: the finest first, none empty.
    explicit TextureLevels(std::vector<Image> levels) : m_levels(std::move(levels)) {}

    /// The colour at `uv`, wrapped by repetition or clamped, over the ellipse duvdx, duvdy; for zeros,
    /// bilinear in the finest level. False: OpenImageIO is to be asked, since the wrap is another or the
    /// ellipse more than kMostStretched times as long as it is wide, which has rules of its own.
    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const;

  private:
    static constexpr float kMostStretched = 16;

    /// Probes along the major axis of an ellipse, all of one weight pattern.
    struct Line {
        V2f middle, half; ///< texture space
        int probes;
        float spread; ///< of the weights: exp(-2 (spread x)²), x in (-1, 1) along the line
    };
    Rgb bilinear(const Image& level, const V2f& uv, Wrap wrap) const;
    Rgb along(const Image& level, const Line& line, Wrap wrap) const;

    std::vector<Image> m_levels;
};

} // namespace strobe
