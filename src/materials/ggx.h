// Half vectors of the GGX distribution (Walter et al., "Microfacet Models for Refraction through Rough
// Surfaces", 2007) as seen from wo, to draw reflections by. A density only: whatever a BRDF's value is.
#pragma once

#include "core/math.h"

namespace strobe {

/// GGX's roughnesses in the plane of wo and the normal and across it, each in (0,1]. Turned with wo they can
/// differ although the surface is isotropic.
struct GgxAlpha {
    float along, across;
};

/// Reflections of one wo at the visible half vectors of GGX (Heitz, "Sampling the GGX Distribution of Visible
/// Normals", 2018): per solid angle of wi, G1(wo) D(wh) / (4 |wo.z|). Alike for (-wo, -wi). Reflections below
/// the horizon are absorbed, so the density integrates to less than 1.
class GgxReflection {
  public:
    /// `wo`: unit.
    GgxReflection(const V3f& wo, const GgxAlpha& alpha)
        : m_alpha(alpha), m_invAlong2(1 / sqr(alpha.along)), m_invAcross2(1 / sqr(alpha.across)),
          m_sinO(std::sqrt(sqr(wo.x) + sqr(wo.y))), m_max(maxPdf(wo, alpha)) {
        m_x = m_sinO > 0 ? V2f(wo.x / m_sinO, wo.y / m_sinO) : V2f(1, 0);
    }

    /// The greatest density over wi: that of the mirror direction. Finite for wo.z = 0 too, as
    /// G1(wo) / |wo.z| = 2 / (|wo.z| + sqrt(wo.z² + along² sin²θo)).
    static float maxPdf(const V3f& wo, const GgxAlpha& alpha) {
        const float cos2 = std::min(sqr(wo.z), 1.f), stretched2 = cos2 + sqr(alpha.along) * (1 - cos2);
        return 1 / (2 * kPi * alpha.along * alpha.across * (std::sqrt(cos2) + std::sqrt(stretched2)));
    }
    /// The density for a wi on wo's side of the surface, given the wo of the constructor again.
    float pdf(const V3f& wo, const V3f& wi) const {
        const V3f h = wo + wi;
        const float along2 = sqr(h.x * m_x.x + h.y * m_x.y), across2 = sqr(h.y * m_x.x - h.x * m_x.y),
                    up2 = sqr(h.z), l2 = along2 + across2 + up2;
        if (!(l2 > 1e-14f)) // wo = -wi along the horizon: no half vector
            return 0;
        return m_max * std::min(1.f, sqr(l2 / (along2 * m_invAlong2 + across2 * m_invAcross2 + up2)));
    }
    /// Draws wi on the side of wo (above for wo.z = 0); u in [0,1)². False: absorbed.
    bool sample(const V3f& wo, const V2f& u, V3f& wi) const;

  private:
    GgxAlpha m_alpha;
    float m_invAlong2, m_invAcross2, m_sinO, m_max;
    V2f m_x; ///< the azimuth of wo
};

} // namespace strobe
