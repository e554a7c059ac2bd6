// Microfacet distributions: Blinn's with the masking of Torrance and Sparrow, and visible normals of GGX.
//
// Directions are unit vectors in the local shading frame that point away from the surface. Densities are per
// solid angle of wi. All functions are symmetric under (wo, wi) -> (-wo, -wi), so lobes built on them are
// two-sided. They are branch-free, so that loops over directions vectorize.
#pragma once

#include "core/math/sampling.h"

namespace strobe {

/// Returns pbrt-v2's Blinn exponent for a roughness: 1/roughness, limited to 10000 (roughness 0 gives 10000).
inline float blinnExponent(float roughness) { return 1 / std::max(roughness, 1e-4f); }

/// The value and density of the Blinn lobe for one pair of directions.
struct BlinnTerm {
    float shape;   ///< D G / (4 |wo.z|); times the Fresnel reflectance this is f |cos wi|
    float cosHalf; ///< wi · wh >= 0, the cosine for the Fresnel term
    float pdf;     ///< density of sampleBlinn; 0 where it draws no direction
};

/// Evaluates the distribution of Blinn ("Models of Light Reflection for Computer Synthesized Pictures", 1977)
/// with the masking of Torrance and Sparrow (1967), as in pbrt-v2:
/// D = (e+2)/2π |cos θh|^e and pdf = (e+1)/2π |cos θh|^e / (4 wo·wh).
STROBE_FORCE_INLINE BlinnTerm evalBlinn(float exponent, const V3f& wo, const V3f& wi) {
    const V3f sum = wo + wi;
    const float l2 = length2(sum); // (2 wo·wh)²
    // Zero for wo = -wi, which has no half vector, and for wo exactly on the horizon.
    const bool isValid = l2 > 1e-14f && wo.z != 0;
    const float l = std::sqrt(l2), cosHalf = std::min(l / 2, 1.f);
    const float cosO = std::abs(wo.z), cosI = std::abs(wi.z);
    const float cosThetaH = std::min(std::abs(sum.z) / l, 1.f);
    const float lobe = fastPow(cosThetaH, exponent) / (2 * kPi);
    const float masking = std::min(1.f, 2 * cosThetaH * std::min(cosO, cosI) / cosHalf);
    const float shape = (exponent + 2) * lobe * masking / (4 * cosO);
    const float pdf = (exponent + 1) * lobe / (4 * cosHalf);
    return {isValid ? shape : 0, isValid ? cosHalf : 0, isValid && wo.z * wi.z > 0 ? pdf : 0};
}

/// Draws wi by reflecting wo at a half vector of density (e+1)/2π cos^e θh on wo's side; u in [0,1)². Returns
/// 0 if wi lies below the horizon: the sample is absorbed.
STROBE_FORCE_INLINE int32_t sampleBlinn(float exponent, const V3f& wo, const V2f& u, V3f& wi) {
    const float cosThetaH = fastPow(1 - u.x, 1 / (exponent + 1)); // 1 - u.x is never 0
    const float sinThetaH = safeSqrt(1 - cosThetaH * cosThetaH);
    const SinCos phi = sinCosOfTurns(u.y);
    const float side = wo.z < 0 ? -1.f : 1.f;
    const V3f wh(sinThetaH * phi.cos, sinThetaH * phi.sin, side * cosThetaH);
    const float cosHalf = dot(wo, wh);
    const V3f reflected = wh * (2 * cosHalf) - wo;
    wi = reflected * (1 / std::sqrt(length2(reflected)));
    return (cosHalf > 0) & (wi.z * wo.z > 0);
}

/// Returns an upper bound of cos^e(t) / cos(thetaO + t) for t in [left, right], using
/// cos^e(t) <= exp(-e t²/2), with margins for rounding.
STROBE_FORCE_INLINE float blinnIntervalBound(float exponent, float thetaO, float left, float right) {
    const float minCos = sinCosOfTurns((thetaO + right) * (kInvPi / 2)).cos * (1 - 1e-4f) - 1e-7f;
    return fastExp(-exponent * left * left / 2) / std::max(minCos, 0.f);
}

/// Returns an upper bound of evalBlinn's pdf over all wi, given wo; infinity for wo.z = 0.
STROBE_FORCE_INLINE float maxBlinnPdf(float exponent, const V3f& wo) {
    // Among half vectors at angle t from the normal, wo·wh is least in the plane of wo, on the far side:
    // cos(thetaO + t). There wi stays above the horizon up to t = (90° - thetaO)/2, and beyond that angle the
    // horizon keeps wo·wh above cosO / (2 cos t), where the pdf only falls. So the maximum is that of
    // cos^e(t) / cos(thetaO + t) over [0, (90° - thetaO)/2], bounded here over six intervals.
    const float cosO = std::min(std::abs(wo.z), 1.f), thetaO = fastAtan2(safeSqrt(1 - cosO * cosO), cosO);
    const float last = (kPi / 2 - thetaO) / 2;
    const float t1 = last / 36, t2 = last / 9, t3 = last / 4, t4 = last / 2.25f, t5 = last / 1.44f;
    const float b1 = blinnIntervalBound(exponent, thetaO, 0, t1);
    const float b2 = blinnIntervalBound(exponent, thetaO, t1, t2);
    const float b3 = blinnIntervalBound(exponent, thetaO, t2, t3);
    const float b4 = blinnIntervalBound(exponent, thetaO, t3, t4);
    const float b5 = blinnIntervalBound(exponent, thetaO, t4, t5);
    const float b6 = blinnIntervalBound(exponent, thetaO, t5, last);
    const float bound = std::max(std::max(std::max(b1, b2), std::max(b3, b4)), std::max(b5, b6));
    return cosO > 0 ? (exponent + 1) / (8 * kPi) * bound * (1 + 1e-4f) : kInfinity;
}

/// The axes of the two roughnesses of GGX.
enum class GgxAxes {
    TurnWithWo, ///< in the plane of wo and the normal, and across it: they may differ for an isotropic
                ///< surface
    Fixed,      ///< x and y of the shading frame
};

/// GGX roughnesses along the first axis and across it, each in (0,1].
struct GgxAlpha {
    float along, across;
};

/// Returns the density of microfacet normals m, times cos θm, per solid angle; without the cosine. `m`: a
/// unit vector with m.z > 0. The axes are fixed.
STROBE_FORCE_INLINE float ggxDistribution(const V3f& m, const GgxAlpha& alpha) {
    const float e = sqr(m.x / alpha.along) + sqr(m.y / alpha.across) + sqr(m.z);
    return 1 / (kPi * alpha.along * alpha.across * sqr(e));
}
/// Returns Smith's Lambda for GGX. The axes are fixed.
STROBE_FORCE_INLINE float ggxLambda(const V3f& w, const GgxAlpha& alpha) {
    const float stretched2 = sqr(alpha.along * w.x) + sqr(alpha.across * w.y);
    return (std::sqrt(1 + stretched2 / std::max(sqr(w.z), 1e-20f)) - 1) / 2;
}
/// Returns Smith's masking of one direction.
STROBE_FORCE_INLINE float ggxMasking(const V3f& w, const GgxAlpha& alpha) {
    return 1 / (1 + ggxLambda(w, alpha));
}
/// Returns Smith's height-correlated masking and shadowing of two directions.
STROBE_FORCE_INLINE float ggxMasking(const V3f& wo, const V3f& wi, const GgxAlpha& alpha) {
    return 1 / (1 + ggxLambda(wo, alpha) + ggxLambda(wi, alpha));
}

/// The reflections of one wo at the visible normals of GGX (Walter et al., "Microfacet Models for Refraction
/// through Rough Surfaces", 2007; Heitz, "Sampling the GGX Distribution of Visible Normals", 2018). The
/// density is G1(wo) D(wh) / (4 |wo.z|) per solid angle of wi. Reflections below the horizon are absorbed, so
/// it integrates to less than 1. The class provides a density only; the value of the BRDF is the caller's.
class GgxReflection {
  public:
    STROBE_FORCE_INLINE GgxReflection(const V3f& wo, const GgxAlpha& alpha,
                                      GgxAxes axes = GgxAxes::TurnWithWo)
        : m_alpha(alpha), m_invAlong2(1 / sqr(alpha.along)), m_invAcross2(1 / sqr(alpha.across)),
          m_max(maxPdf(wo, alpha, axes)) {
        const bool isFixed = axes == GgxAxes::Fixed;
        const float sinO = std::sqrt(sqr(wo.x) + sqr(wo.y));
        const float cosine = wo.x / sinO, sine = wo.y / sinO;
        m_cosPhi = sinO > 0 && !isFixed ? cosine : 1;
        m_sinPhi = sinO > 0 && !isFixed ? sine : 0;
        m_viewX = isFixed ? wo.x : sinO;
        m_viewY = isFixed ? wo.y : 0;
    }

    /// Returns the maximum of the density over wi, which is at the mirror direction. It is finite for
    /// wo.z = 0, because G1(wo) / |wo.z| = 2 / (|wo.z| + sqrt(wo.z² + along² sin²θo)).
    STROBE_FORCE_INLINE static float maxPdf(const V3f& wo, const GgxAlpha& alpha,
                                            GgxAxes axes = GgxAxes::TurnWithWo) {
        const float cos2 = std::min(sqr(wo.z), 1.f);
        const float turning2 = cos2 + sqr(alpha.along) * (1 - cos2);
        const float fixed2 = cos2 + sqr(alpha.along * wo.x) + sqr(alpha.across * wo.y);
        const float stretched2 = axes == GgxAxes::Fixed ? fixed2 : turning2;
        return 1 / (2 * kPi * alpha.along * alpha.across * (std::sqrt(cos2) + std::sqrt(stretched2)));
    }
    /// Returns the density for a wi on wo's side of the surface. `wo`: as passed to the constructor.
    STROBE_FORCE_INLINE float pdf(const V3f& wo, const V3f& wi) const {
        const V3f h = wo + wi;
        const float along2 = sqr(h.x * m_cosPhi + h.y * m_sinPhi);
        const float across2 = sqr(h.y * m_cosPhi - h.x * m_sinPhi);
        const float up2 = sqr(h.z), l2 = along2 + across2 + up2;
        const float shape = sqr(l2 / (along2 * m_invAlong2 + across2 * m_invAcross2 + up2));
        // wo = -wi along the horizon has no half vector.
        return l2 > 1e-14f ? m_max * std::min(1.f, shape) : 0;
    }
    /// Draws wi on the side of wo (above the surface for wo.z = 0); u in [0,1)². Returns 0 if the sample is
    /// absorbed.
    STROBE_FORCE_INLINE int32_t sample(const V3f& wo, const V2f& u, V3f& wi) const {
        const V3f view(m_viewX, m_viewY, std::abs(wo.z)), wh = visibleNormal(view, u);
        const float l2 = length2(wh);
        const V3f reflected = wh * (2 * dot(view, wh) / l2) - view;
        const V3f w = reflected * (1 / std::sqrt(length2(reflected)));
        wi.x = w.x * m_cosPhi - w.y * m_sinPhi;
        wi.y = w.x * m_sinPhi + w.y * m_cosPhi;
        wi.z = wo.z < 0 ? -w.z : w.z;
        return (l2 > 1e-14f) & (w.z > 0); // no half vector, or wi below the horizon
    }
    /// Draws a visible normal for wo.z >= 0 and fixed axes; (0,0,1) where there is none.
    STROBE_FORCE_INLINE V3f sampleNormal(const V3f& wo, const V2f& u) const {
        const V3f wh = visibleNormal(wo, u);
        const float l2 = length2(wh);
        return l2 > 1e-14f ? wh * (1 / std::sqrt(l2)) : V3f(0, 0, 1);
    }

  private:
    /// Draws a visible normal, not normalized (Dupuy & Benyoub, "Sampling Visible GGX Normals with Spherical
    /// Caps", 2023): where the ellipsoid is stretched to a sphere, reflections are uniform over the cap z >=
    /// -stretched.z. `view`: wo in the frame of the axes, above the surface.
    STROBE_FORCE_INLINE V3f visibleNormal(const V3f& view, const V2f& u) const {
        const V3f wide(m_alpha.along * view.x, m_alpha.across * view.y, view.z);
        const V3f stretched = wide * (1 / std::sqrt(length2(wide)));
        const V3f h = uniformCone(u, 1 + std::min(stretched.z, 1.f)) + stretched;
        return {m_alpha.along * h.x, m_alpha.across * h.y, std::max(h.z, 0.f)};
    }

    GgxAlpha m_alpha;
    float m_invAlong2, m_invAcross2, m_max;
    float m_cosPhi, m_sinPhi; ///< of the first axis
    float m_viewX, m_viewY;   ///< wo in the frame of the axes
};

} // namespace strobe
