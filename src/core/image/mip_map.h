// The MIP levels of a small image in memory, looked up by footprint.
#pragma once

#include "core/image/texture_cache.h"

namespace strobe {

/// Lookups as OpenImageIO's texture system makes them (bilinear in two levels, several times along the major
/// axis of the footprint), without its tiles, locks and conversions; many side by side. What is rare is left
/// to OpenImageIO.
class MipMap {
  public:
    /// `levels`: the finest first, none empty.
    explicit MipMap(const std::vector<Image>& levels);

    /// For i from `begin` to `end`: the color at uv[i], wrapped by repetition or clamped, over the ellipse
    /// duvdx[i], duvdy[i]; for zeros, bilinear in the finest level. Where found[i] becomes 0, OpenImageIO is
    /// to be asked, since the wrap is another or the ellipse large. Neighbors change nothing, to the bit.
    void lookupSoA(const TexturePointSoA& at, int begin, int end, Wrap wrap, RgbSoA& out,
                   int32_t* found) const;
    /// One of them; what is returned is `found`.
    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const;

  private:
    struct alignas(16) Texel {
        float numbers[4]; ///< red, green, blue, 1
    };
    struct Shapes;
    struct Lines;
    struct Taken;
    void addTexels(const Taken& taken, int k, Texel& sum) const;
    void probe(const Lines& lines, int32_t repeats, Texel* sums) const;

    int m_longestSide = 0;                           ///< of the finest level
    std::vector<int32_t> m_width, m_height, m_first; ///< by level; the latter among the texels
    std::vector<float> m_lesserSide;
    std::vector<Texel> m_texels; ///< of all levels
};

} // namespace strobe
