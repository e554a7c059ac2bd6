// Half vectors of the GGX distribution (Walter et al., "Microfacet Models for Refraction through Rough
// Surfaces", 2007) as seen from wo, to draw reflections by. A density only: whatever a BRDF's value is.
// Without branches, for loops over directions.
#pragma once

#include "core/math/sampling.h"

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
    STROBE_FORCE_INLINE GgxReflection(const V3f& wo, const GgxAlpha& alpha)
        : m_alpha(alpha), m_invAlong2(1 / sqr(alpha.along)), m_invAcross2(1 / sqr(alpha.across)),
          m_sinO(std::sqrt(sqr(wo.x) + sqr(wo.y))), m_max(maxPdf(wo, alpha)) {
        const float cosine = wo.x / m_sinO, sine = wo.y / m_sinO;
        m_cos = m_sinO > 0 ? cosine : 1, m_sin = m_sinO > 0 ? sine : 0;
    }

    /// The greatest density over wi: that of the mirror direction. Finite for wo.z = 0 too, as
    /// G1(wo) / |wo.z| = 2 / (|wo.z| + sqrt(wo.z² + along² sin²θo)).
    STROBE_FORCE_INLINE static float maxPdf(const V3f& wo, const GgxAlpha& alpha) {
        const float cos2 = std::min(sqr(wo.z), 1.f), stretched2 = cos2 + sqr(alpha.along) * (1 - cos2);
        return 1 / (2 * kPi * alpha.along * alpha.across * (std::sqrt(cos2) + std::sqrt(stretched2)));
    }
    /// The density for a wi on wo's side of the surface, given the wo of the constructor again.
    STROBE_FORCE_INLINE float pdf(const V3f& wo, const V3f& wi) const {
        const V3f h = wo + wi;
        const float along2 = sqr(h.x * m_cos + h.y * m_sin), across2 = sqr(h.y * m_cos - h.x * m_sin),
                    up2 = sqr(h.z), l2 = along2 + across2 + up2;
        const float shape = sqr(l2 / (along2 * m_invAlong2 + across2 * m_invAcross2 + up2));
        // wo = -wi along the horizon has no half vector.
        return l2 > 1e-14f ? m_max * std::min(1.f, shape) : 0;
    }
    /// Draws wi on the side of wo (above for wo.z = 0); u in [0,1)². 0: absorbed.
    STROBE_FORCE_INLINE int32_t draw(const V3f& wo, const V2f& u, V3f& wi) const {
        // Dupuy & Benyoub, "Sampling Visible GGX Normals with Spherical Caps" (2023): where the ellipsoid is
        // stretched to a sphere, reflections are uniform over the cap z >= -stretched.z. In wo's plane,
        // above.
        const V3f view(m_sinO, 0, std::abs(wo.z));
        const V3f wide(m_alpha.along * view.x, 0, view.z), stretched = wide * (1 / std::sqrt(length2(wide)));
        const V3f h = uniformCone(u, 1 + std::min(stretched.z, 1.f)) + stretched;
        const V3f wh(m_alpha.along * h.x, m_alpha.across * h.y, std::max(h.z, 0.f));
        const float l2 = length2(wh);
        const V3f reflected = wh * (2 * dot(view, wh) / l2) - view;
        const V3f w = reflected * (1 / std::sqrt(length2(reflected)));
        wi.x = w.x * m_cos - w.y * m_sin;
        wi.y = w.x * m_sin + w.y * m_cos;
        wi.z = wo.z < 0 ? -w.z : w.z;
        return (l2 > 1e-14f) & (w.z > 0); // else against the view, along the horizon; or below it
    }

  private:
    GgxAlpha m_alpha;
    float m_invAlong2, m_invAcross2, m_sinO, m_max;
    float m_cos, m_sin; ///< of the azimuth of wo
};

} // namespace strobe
