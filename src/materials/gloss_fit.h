// A sampling density for a BRDF that is given by its values only: a mixture of a cosine lobe and a GGX lobe.
#pragma once

#include "materials/microfacet.h"

#include <functional>

namespace strobe {

/// The probability and the roughnesses of the GGX lobe, and the reflectance, as functions of |wo.z|, found
/// once from the values of a BRDF. Immutable.
class GlossFit {
  public:
    struct Lobe {
        float probability; ///< of sampling the GGX lobe rather than the cosine; 0: no GGX lobe
        GgxAlpha alpha;
    };
    /// One channel of an isotropic BRDF: f(wo, wi) >= 0 for unit directions above the surface.
    using Brdf = std::function<float(const V3f& wo, const V3f& wi)>;

    /// Fits the lobe at kSteps + 1 values of |wo.z|: by quadrature, the lobe that gives f |wi.z| / pdf the
    /// least variance.
    explicit GlossFit(const Brdf& f);

    /// Returns the lobe for `cosO` in [-1,1], interpolated linearly in |cosO|.
    STROBE_FORCE_INLINE Lobe at(float cosO) const {
        const Place place(cosO);
        return {place.in(m_probability), {place.in(m_along), place.in(m_across)}};
    }
    /// Returns the integral of f |wi.z| over all wi for `cosO` in [-1,1], interpolated likewise, but at least
    /// 1/1000 of the largest one; 1 if f is 0 everywhere.
    float reflectance(float cosO) const { return Place(cosO).in(m_reflectance); }

  private:
    static constexpr int kSteps = 16;
    using Table = float[kSteps + 1]; ///< values at |wo.z| = i / kSteps

    /// A place between two values of a table.
    struct Place {
        int i;
        float t;

        STROBE_FORCE_INLINE explicit Place(float cosO) {
            const float x = std::min(std::abs(cosO), 1.f) * kSteps;
            i = std::min(int(x), kSteps - 1);
            t = x - float(i);
        }
        STROBE_FORCE_INLINE float in(const Table& table) const { return lerp(table[i], table[i + 1], t); }
    };

    Table m_probability, m_along, m_across, m_reflectance;
};

} // namespace strobe
