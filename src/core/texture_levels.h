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
    /// ellipse large.
    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const;

  private:
    static constexpr int kMostStretched = 32; ///< of ellipses; those that are more are taken for wider ones
    static constexpr float kLongest = 1000;   ///< ellipse, in images

    /// Probes along the major axis of an ellipse, fewer than 2 kMostStretched.
    struct Line {
        V2f middle, half; ///< texture space
        int probes;
        /// Of each probe, which is at middle + x half; unless there is but one.
        float x[2 * kMostStretched], weight[2 * kMostStretched];
        float weights = 0; ///< their sum

        Line(const V2f& at, const V2f& toEnd, int n, float spread);
    };
    Rgb bilinear(const Image& level, const V2f& uv, Wrap wrap) const;
    Rgb along(const Image& level, const Line& line, Wrap wrap) const;

    std::vector<Image> m_levels;
};

} // namespace strobe
