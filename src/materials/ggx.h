// Half vectors of the GGX distribution (Walter et al., "Microfacet Models for Refraction through Rough
// Surfaces", 2007) as seen from wo, to draw reflections by. A density only: whatever a BRDF's value is.
#pragma once

#include "core/math.h"

namespace strobe {

/// Reflections of one wo at the visible half vectors of GGX with roughness alpha (Heitz, "Sampling the GGX
/// Distribution of Visible Normals", 2018): per solid angle of wi, G1(wo) D(wh) / (4 |wo.z|). Alike for
/// (-wo, -wi). Reflections below the horizon are absorbed, so the density integrates to less than 1.
class GgxReflection {
  public:
    /// `wo`: unit; `alpha` in (0,1].
    GgxReflection(const V3f& wo, float alpha)
        : m_alpha(alpha), m_invAlpha2(1 / sqr(alpha)), m_max(maxPdf(wo, alpha)) {}

    /// The greatest density over wi: that of the mirror direction. Finite for wo.z = 0 too, as
    /// G1(wo) / |wo.z| = 2 / (|wo.z| + sqrt(alpha² + (1 - alpha²) wo.z²)).
    static float maxPdf(const V3f& wo, float alpha) {
        const float cosO = std::min(std::abs(wo.z), 1.f), alpha2 = sqr(alpha);
        return 1 / (2 * kPi * alpha2 * (cosO + std::sqrt(alpha2 + (1 - alpha2) * sqr(cosO))));
    }
    /// The density for a wi on wo's side of the surface.
    float pdf(const V3f& wo, const V3f& wi) const {
        const V3f h = wo + wi;
        const float flat2 = sqr(h.x) + sqr(h.y), up2 = sqr(h.z), l2 = flat2 + up2;
        if (!(l2 > 1e-14f)) // wo = -wi along the horizon: no half vector
            return 0;
        return m_max * std::min(1.f, sqr(l2 / (flat2 * m_invAlpha2 + up2)));
    }
    /// Draws wi on the side of wo (above for wo.z = 0); u in [0,1)². False: absorbed.
    bool sample(const V3f& wo, const V2f& u, V3f& wi) const;

  private:
    float m_alpha, m_invAlpha2, m_max;
};

} // namespace strobe
