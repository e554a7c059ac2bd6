// MIP levels of an image in memory.
#pragma once

#include "core/image/mip_layout.h"
#include "core/image/texel_codec.h"
#include "core/image/texel_memory.h"
#include "core/image/texture_cache.h"
#include "core/math/api.h"

namespace STROBE_API strobe {

/// The MIP levels of an image, filtered anisotropically like in OpenImageIO's texture system: bilinear probes
/// along the major axis of the footprint, in two levels. Faster than OpenImageIO, since it needs no tiles,
/// locks and is vectorized over lookups. Texels are floats, or codes that are decoded where they are used.
class MipMap {
  public:
    /// Stores floats. `levels` starts with the finest level. Precondition: there is a level, and none is
    /// empty.
    explicit MipMap(const std::vector<Image>& levels);
    /// Takes texels that are stored as codes of `codec`, `channels` (1 or 3) for each.
    MipMap(const MipLayout& layout, std::unique_ptr<TexelMemory> texels,
           std::shared_ptr<const TexelCodec> codec, int channels);

    const TexelMemory& memory() const { return *m_memory; }

    /// Looks up points begin … end-1, filtered over the ellipses with axes duvdx and duvdy; zero derivatives
    /// select bilinear interpolation in the finest level. Sets isDone[i] to 0, and leaves out[i] undefined,
    /// where the caller must look up differently: for Wrap::Black, and for very large ellipses or
    /// coordinates. A result does not depend on the other points, to the bit.
    void lookupSoA(const TexturePointSoA& points, int begin, int end, const TextureOptions& options,
                   RgbSoA& out, int32_t* isDone) const;
    /// Looks up one point, as lookupSoA. Returns its `isDone`.
    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, const TextureOptions& options,
                Rgb& out) const;
    /// Looks up any point: ellipses and coordinates that are too large are reduced to equivalent ones, and
    /// Wrap::Black is black where uv is outside of the image.
    Rgb lookupAnywhere(V2f uv, V2f duvdx, V2f duvdy, TextureOptions options) const;

  private:
    struct alignas(16) Texel {
        float values[4]; ///< red, green, blue, 1
    };
    struct Lines;
    struct Taps;
    struct Wraps;
    void setLevels(const MipLayout& layout);
    /// Adds the weighted texels of the taps of line k to `sum`. `Code` is the type of stored values.
    template <class Code, int Channels>
    void addTexels(const Taps& taps, int k, Texel& sum) const;
    /// Writes the sum of the weighted probes of each line to `sums`.
    template <class Code, int Channels>
    void sumProbes(const Lines& lines, const Wraps& wraps, Texel* sums) const;
    template <class Code>
    void sumProbes(const Lines& lines, const Wraps& wraps, Texel* sums) const {
        m_channels == 1 ? sumProbes<Code, 1>(lines, wraps, sums) : sumProbes<Code, 3>(lines, wraps, sums);
    }

    int m_longerSide = 0;                   ///< of the finest level, in texels
    std::vector<int32_t> m_width, m_height; ///< by level
    /// By level: see MipLayout.
    std::vector<int32_t> m_firstTexel, m_tileRowStep, m_tileStep, m_rowStep;
    std::vector<float> m_shorterSide; ///< by level, in texels
    int m_channels = 4;               ///< stored values per texel
    std::unique_ptr<TexelMemory> m_memory;
    std::shared_ptr<const TexelCodec> m_codec; ///< null: each texel is a Texel
};

} // namespace strobe
