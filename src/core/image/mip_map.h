// MIP levels of an image in memory.
#pragma once

#include "core/image/texture_cache.h"
#include "core/math/api.h"

namespace STROBE_API strobe {

/// The MIP levels of an image, filtered anisotropically like in OpenImageIO's texture system: bilinear probes
/// along the major axis of the footprint, in two levels. Faster than OpenImageIO, since it needs no tiles,
/// locks or conversions and is vectorized over lookups. Rare cases are left to OpenImageIO.
class MipMap {
  public:
    /// `levels` starts with the finest level. Precondition: there is a level, and none is empty.
    explicit MipMap(const std::vector<Image>& levels);

    /// Looks up points begin … end-1, filtered over the ellipses with axes duvdx and duvdy; zero derivatives
    /// select bilinear interpolation in the finest level. Sets isDone[i] to 0, and leaves out[i] undefined,
    /// where the caller must use OpenImageIO instead: for wrap modes other than Repeat and Clamp, and for
    /// very large ellipses or coordinates. A result does not depend on the other points, to the bit.
    void lookupSoA(const TexturePointSoA& points, int begin, int end, Wrap wrap, RgbSoA& out,
                   int32_t* isDone) const;
    /// Looks up one point, as lookupSoA. Returns its `isDone`.
    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap, Rgb& out) const;

  private:
    struct alignas(16) Texel {
        float values[4]; ///< red, green, blue, 1
    };
    struct Footprints;
    struct Lines;
    struct Taps;
    /// Adds the weighted texels of the taps of line k to `sum`.
    void addTexels(const Taps& taps, int k, Texel& sum) const;
    /// Writes the sum of the weighted probes of each line to `sums`. `repeatMask`: all bits set for
    /// Wrap::Repeat, 0 for Wrap::Clamp.
    void sumProbes(const Lines& lines, int32_t repeatMask, Texel* sums) const;

    int m_longerSide = 0;                   ///< of the finest level, in texels
    std::vector<int32_t> m_width, m_height; ///< by level
    std::vector<int32_t> m_firstTexel;      ///< by level: index in m_texels
    std::vector<float> m_shorterSide;       ///< by level, in texels
    std::vector<Texel> m_texels;            ///< of all levels
};

} // namespace strobe
