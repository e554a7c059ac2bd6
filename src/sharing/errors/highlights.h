// Bright light that is not rare, as that of highlights.
#pragma once

#include "core/util/memory.h"

#include <array>

namespace strobe {

/// The light of one part above RareLimits that is not rare, by pixel and half of the samples. A fit averages
/// a highlight of one or two pixels over its region, which becomes too bright. Therefore, this light stays in
/// its pixels as far as its contrast is large beside its noise. The products of the halves show the contrast,
/// their differences show the noise.
class Highlights {
  public:
    /// There is no light yet.
    Highlights(int width, int height)
        : m_width(width), m_height(height), m_light(size_t(width) * size_t(height)) {}
    /// Adds light to a half of a pixel, relative to all samples of this half.
    void add(size_t pixel, int half, float light) { m_light[pixel][size_t(half)] += light; }
    /// Returns the fraction of the light of a pixel that stays there, in [0,1].
    float kept(size_t pixel) const;

  private:
    const int m_width, m_height;
    HugeVector<std::array<float, 2>> m_light; ///< by pixel: that of both halves
};

} // namespace strobe
