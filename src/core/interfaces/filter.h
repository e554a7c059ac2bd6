// The interface of pixel filters.
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"

namespace STROBE_API strobe {

/// Interface of pixel filters. Filters are importance-sampled instead of splatted (Ernst et al., "Filter
/// Importance Sampling", 2006), so the value of a pixel is the mean of its weighted samples. Filters are
/// immutable, and all functions are thread-safe. Offsets are in pixels, from the center of the pixel.
class Filter {
  public:
    virtual ~Filter() = default;

    struct Sample {
        V2f offset;
        /// Filter value divided by the pdf: 1 for non-negative filters; ±c for filters with negative lobes.
        /// The expected value is 1.
        float weight;
    };
    /// Samples an offset with density |f(x,y)| / ∫|f| per square pixel; u in [0,1)².
    virtual Sample sample(const V2f& u) const = 0;
    /// Samples offsets with u's elements 0 … n-1, n <= kSoAWidth; same results as `sample`, to the bit. The
    /// default calls `sample`.
    virtual void sampleSoA(const V2SoA& u, int n, V2SoA& offset, float* weight) const;
    /// Evaluates the filter function, normalized to an integral of 1; 0 outside the radius. Used by tests
    /// only.
    virtual float eval(const V2f& offset) const = 0;
    /// Returns the half-widths of the support in pixels.
    virtual V2f radius() const = 0;
};

} // namespace strobe
