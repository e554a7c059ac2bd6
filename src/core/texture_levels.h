// The MIP levels of a small image in memory, looked up by footprint.
#pragma once

#include "core/image.h"

namespace strobe {

/// A lookup as OpenImageIO's texture system makes it (bilinear in two levels, several times along the major
/// axis of the footprint), without its tiles, locks and conversions. What is rare is left to OpenImageIO.
class TextureLevels {
  public:
    /// `levels`: the finest first, none empty.
    explicit TextureLevels(const std::vector<Image>& levels) : m_levels(levels.begin(), levels.end()) {}

    /// The colour at `uv`, wrapped by repetition or clamped, over the ellipse duvdx, duvdy; for zeros,
    /// bilinear in the finest level. False: OpenImageIO is to be asked, since the wrap is another or the
    /// ellipse large.
    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const;

  private:
    static constexpr int kMostStretched = 32; ///< of ellipses; those that are more are taken for wider ones
    static constexpr int kMostProbes = 2 * kMostStretched;
    static constexpr float kLongest = 1000; ///< ellipse, in images

    struct alignas(16) Texel {
        float numbers[4]; ///< red, green, blue, nothing
    };
    struct Level {
        int width, height;
        std::vector<Texel> texels;

        explicit Level(const Image& image);
    };
    /// Probes along the major axis of an ellipse.
    struct Line {
        V2f middle, half; ///< texture space
        int probes;
        /// Of each probe, which is at middle + x half; unless there is but one.
        alignas(64) float x[kMostProbes];
        alignas(64) float weight[kMostProbes];
        float weights = 0; ///< their sum

        Line(const V2f& at, const V2f& toEnd, int n, float spread);
    };
    /// What the probes of a line take: of each the four texels around, by index, and how much of these.
    struct Taken {
        alignas(64) int32_t texel[4][kMostProbes];
        alignas(64) float weight[4][kMostProbes];
    };
    static void take(const Level& level, const Line& line, bool repeats, Taken& out);
    static Rgb bilinear(const Level& level, const V2f& uv, bool repeats);
    static Rgb along(const Level& level, const Line& line, bool repeats);
    static float lesserSide(const Level& level) { return float(std::min(level.width, level.height)); }

    std::vector<Level> m_levels;
};

} // namespace strobe
