// Which samples of a pixel are in the negative lobes of the filter.
#pragma once

#include "core/math/hash.h"
#include "core/math/math.h"

#include <cmath>

namespace strobe {

/// Decides which samples of a pixel are in the negative lobes of the filter: of the first n samples, np
/// rounded down, with the fraction p. They are the same ones in all pixels: if chance decided, even a white
/// image would have noise. Pixels of fewer samples than 1 / p are filtered by the positive lobes only.
class FilterSigns {
  public:
    /// `negativeFraction`: see Filter.
    explicit FilterSigns(float negativeFraction) : m_fraction(double(negativeFraction)) {}
    bool hasNegative() const { return m_fraction > 0; }
    /// Returns whether a sample is in a negative lobe, by its number in the pixel.
    bool isNegative(uint64_t sample) const { return negativesBefore(sample + 1) > negativesBefore(sample); }
    /// Returns the point in [0,1)² for a sample in a negative lobe. The points of a sampler would not do:
    /// every 16th point of a Sobol' sequence is in one stratum. These are an additive recurrence (Roberts,
    /// "The Unreasonable Effectiveness of Quasirandom Sequences", 2018), shifted by a hash of the pixel's
    /// domain.
    V2f point(uint64_t sample, uint64_t domain) const {
        constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;
        const uint64_t hash = hashCombine(domain, 0x7369676e);
        const auto shifted = [n = double(negativesBefore(sample))](double step, uint64_t bits) {
            const double x = n * step + double(unitFloat(uint32_t(bits)));
            return std::min(float(x - std::floor(x)), kOneMinusEpsilon);
        };
        return {shifted(kStepX, hash), shifted(kStepY, hash >> 32)};
    }

  private:
    uint64_t negativesBefore(uint64_t sample) const { return uint64_t(double(sample) * m_fraction); }
    double m_fraction;
};

} // namespace strobe
