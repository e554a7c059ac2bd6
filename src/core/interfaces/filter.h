// The pixel filter seam: filters are importance-sampled, never splatted, so a pixel's value is a plain mean.
#pragma once

#include "core/math/soa.h"

namespace strobe {

class Filter {
  public:
    virtual ~Filter() = default;
    struct Sample {
        V2f offset;   ///< from the pixel's center, in pixels
        float weight; ///< f/pdf: constant 1 for non-negative filters; ±c where the filter has negative lobes
    };
    /// Draws an offset with density |f(x,y)| / ∫|f|; `u` in [0,1)². The mean of `weight` is 1.
    virtual Sample sample(const V2f& u) const = 0;
    /// The same of u's lanes 0 … n-1.
    virtual void sampleSoA(const V2SoA& u, int n, V2SoA& offset, float* weight) const;
    /// The normalized filter's value at `offset` (integrates to 1 over the plane). For tests.
    virtual float eval(const V2f& offset) const = 0;
    /// Half-widths of the support in pixels.
    virtual V2f radius() const = 0;
};

} // namespace strobe
