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
        float numbers[4]; ///< red, green, blue, 1
    };
    struct Level {
        int width, height;
        std::vector<Texel> texels;

        explicit Level(const Image& image);
        int lesserSide() const { return std::min(width, height); }
    };
    /// Probes along the major axis of an ellipse, in texture space, from middle - half to middle + half.
    struct Line {
        V2f middle, half;
        int probes;
        float spread; ///< weights are exp(-2 (spread x)²), at x from -1 to 1
    };
    /// What the probes of a line take: of each the four texels around, by index, and how much of these.
    struct Taken {
        alignas(64) int32_t texel[4][kMostProbes];
        alignas(64) float weight[4][kMostProbes];
    };
    static void take(const Line& line, const Level& finer, const Level* coarser, bool repeats, Taken* out);
    static Rgb bilinear(const Level& level, const V2f& uv, bool repeats);
    static Rgb mean(const Level& level, const Taken& taken, int probes);
    static Rgb along(const Line& line, const Level& finer, const Level* coarser, float blend, bool repeats);

    std::vector<Level> m_levels;
};

} // namespace strobe
