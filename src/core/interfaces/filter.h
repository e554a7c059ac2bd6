// The interface of pixel filters.
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"

namespace STROBE_API strobe {

/// Interface of pixel filters f(x,y). Filters are importance-sampled instead of splatted (Ernst et al.,
/// "Filter Importance Sampling", 2006): a pixel is the mean of its samples, which have the weight 1, or -1 in
/// negative lobes. The number of a sample decides about the sign, not chance (see FilterSigns). Filters are
/// immutable, and all functions are thread-safe. Offsets are in pixels, from the center of the pixel.
class Filter {
  public:
    virtual ~Filter() = default;

    /// Samples an offset with density max(f,0) / ∫max(f,0) per square pixel; u in [0,1)².
    virtual V2f sample(const V2f& u) const = 0;
    /// Samples offsets with u's elements 0 … n-1, n <= kSoAWidth; same results as `sample`, to the bit. The
    /// default calls `sample`.
    virtual void sampleSoA(const V2SoA& u, int n, V2SoA& offset) const;
    /// Returns ∫max(-f,0) / ∫|f|, which is less than 1/2. The default returns 0.
    virtual float negativeFraction() const { return 0; }
    /// Samples an offset with density max(-f,0) / ∫max(-f,0) per square pixel; u in [0,1)². Precondition:
    /// negativeFraction() > 0. The default returns the center.
    virtual V2f sampleNegative(const V2f& u) const;
    /// Evaluates the filter function, normalized to an integral of 1; 0 outside the radius. Used by tests
    /// only.
    virtual float eval(const V2f& offset) const = 0;
    /// Returns the half-widths of the support in pixels.
    virtual V2f radius() const = 0;
};

} // namespace strobe
