// How to draw reflections for a BRDF known by its values only: a mixture of the cosine and a GGX lobe.
#pragma once

#include "materials/ggx.h"

#include <functional>

namespace strobe {

/// The share and the roughnesses of the lobe as functions of |wo.z|, estimated once from the BRDF's values.
/// Immutable.
class GlossFit {
  public:
    struct Lobe {
        float share; ///< the probability of drawing from the lobe rather than from the cosine; 0: no lobe
        GgxAlpha alpha;
    };
    /// f(wo, wi) >= 0 for unit directions above the surface: an isotropic BRDF, in one channel.
    using Brdf = std::function<float(const V3f& wo, const V3f& wi)>;

    /// At each of several wo the lobe with the least variance of f |wi.z| / pdf, by quadrature.
    explicit GlossFit(const Brdf& f);

    /// Linear between the wo of the fit. `cosO`: any sign, at most 1 in magnitude.
    STROBE_FORCE_INLINE Lobe at(float cosO) const {
        const float x = std::min(std::abs(cosO), 1.f) * kSteps;
        const int i = std::min(int(x), kSteps - 1);
        const float t = x - float(i);
        return {lerp(m_share[i], m_share[i + 1], t),
                {lerp(m_along[i], m_along[i + 1], t), lerp(m_across[i], m_across[i + 1], t)}};
    }

  private:
    static constexpr int kSteps = 16;
    float m_share[kSteps + 1], m_along[kSteps + 1], m_across[kSteps + 1]; ///< at |wo.z| = i / kSteps
};

} // namespace strobe
