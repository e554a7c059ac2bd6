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
        const float x = std::min(std::abs(cosO), 1.f) * kSteps;
        const int i = std::min(int(x), kSteps - 1);
        const float t = x - float(i);
        return {lerp(m_probability[i], m_probability[i + 1], t),
                {lerp(m_along[i], m_along[i + 1], t), lerp(m_across[i], m_across[i + 1], t)}};
    }

    /// Returns the integral of f |wi.z| over all wi for `cosO` in [-1,1], interpolated likewise. It is at
    /// least 1/1000 of the largest one, and positive.
    float reflectance(float cosO) const {
        const float x = std::min(std::abs(cosO), 1.f) * kSteps;
        const int i = std::min(int(x), kSteps - 1);
        return lerp(m_reflectance[i], m_reflectance[i + 1], x - float(i));
    }

  private:
    static constexpr int kSteps = 16;
    // Values at |wo.z| = i / kSteps.
    float m_probability[kSteps + 1];
    float m_along[kSteps + 1], m_across[kSteps + 1];
    float m_reflectance[kSteps + 1];
};

} // namespace strobe
