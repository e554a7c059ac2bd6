// The Blinn microfacet distribution and Torrance and Sparrow's masking, as pbrt-v2 uses them (Blinn, "Models
// of Light Reflection for Computer Synthesized Pictures", 1977; Torrance & Sparrow 1967). Symmetric under
// (wo, wi) -> (-wo, -wi), so lobes made of them are two-sided. Without branches, for loops over directions.
#pragma once

#include "core/math/fast_math.h"

namespace strobe {

/// pbrt-v2's exponent of a roughness: 1/roughness, at most (and, for roughness 0, exactly) 10000.
inline float blinnExponent(float roughness) { return 1 / std::max(roughness, 1e-4f); }

/// What all microfacet lobes share for one pair of directions.
struct MicrofacetTerm {
    float shape;   ///< D G / (4 |wo.z|): times the reflectance, this is f |cos wi|
    float cosHalf; ///< wi · wh, the cosine that Fresnel terms take; >= 0
    float pdf;     ///< of drawBlinn, per solid angle; 0 where it never goes
};

/// D = (e+2)/2π |cos θh|^e and pdf = (e+1)/2π |cos θh|^e / (4 wo·wh), for unit wo and wi.
STROBE_FORCE_INLINE MicrofacetTerm evalBlinn(float exponent, const V3f& wo, const V3f& wi) {
    const V3f sum = wo + wi;
    const float l2 = length2(sum); // (2 wo·wh)²
    // wo = -wi has no half vector; the pair carries nothing, and neither does a viewer exactly on the
    // horizon.
    const bool counts = l2 > 1e-14f && wo.z != 0;
    const float l = std::sqrt(l2), cosHalf = std::min(l / 2, 1.f), cosO = std::abs(wo.z),
                cosI = std::abs(wi.z);
    const float cosThetaH = std::min(std::abs(sum.z) / l, 1.f);
    const float lobe = fastPow(cosThetaH, exponent) / (2 * kPi);
    const float masking = std::min(1.f, 2 * cosThetaH * std::min(cosO, cosI) / cosHalf);
    const float shape = (exponent + 2) * lobe * masking / (4 * cosO);
    const float pdf = (exponent + 1) * lobe / (4 * cosHalf);
    return {counts ? shape : 0, counts ? cosHalf : 0, counts && wo.z * wi.z > 0 ? pdf : 0};
}

/// Draws wi by reflecting wo at a half vector of density (e+1)/2π cos^e (u in [0,1)²) on wo's side. 0: wi
/// lies below the horizon, the sample is absorbed.
STROBE_FORCE_INLINE int32_t drawBlinn(float exponent, const V3f& wo, const V2f& u, V3f& wi) {
    const float cosThetaH = fastPow(1 - u.x, 1 / (exponent + 1)); // 1 - u: never 0
    const float sinThetaH = safeSqrt(1 - cosThetaH * cosThetaH);
    const SinCos phi = sinCosOfTurns(u.y);
    const float side = wo.z < 0 ? -1.f : 1.f;
    const V3f wh(sinThetaH * phi.cos, sinThetaH * phi.sin, side * cosThetaH);
    const float cosHalf = dot(wo, wh);
    const V3f reflected = wh * (2 * cosHalf) - wo;
    wi = reflected * (1 / std::sqrt(length2(reflected)));
    return (cosHalf > 0) & (wi.z * wo.z > 0);
}

/// Of cos^e(t) / cos(thetaO + t) for t in [left, right], by cos^e(t) <= exp(-e t²/2); with margins for
/// rounding.
STROBE_FORCE_INLINE float blinnPeakBound(float exponent, float thetaO, float left, float right) {
    const float lowest = sinCosOfTurns((thetaO + right) * (kInvPi / 2)).cos * (1 - 1e-4f) - 1e-7f;
    return fastExp(-exponent * left * left / 2) / std::max(lowest, 0.f);
}

/// An upper bound of evalBlinn's pdf over all wi, given wo. Infinite for wo.z = 0.
STROBE_FORCE_INLINE float maxBlinnPdf(float exponent, const V3f& wo) {
    // Among half vectors at angle t from the normal, wo·wh is least in the plane of wo, on the far side:
    // cos(thetaO + t). There wi stays above the horizon up to t = (90° - thetaO)/2, and beyond that angle the
    // horizon keeps wo·wh above cosO / (2 cos t), where the pdf only falls. So the maximum is that of
    // cos^e(t) / cos(thetaO + t) over [0, (90° - thetaO)/2], bounded here over six intervals.
    const float cosO = std::min(std::abs(wo.z), 1.f), thetaO = fastAtan2(safeSqrt(1 - cosO * cosO), cosO);
    const float last = (kPi / 2 - thetaO) / 2;
    const float t1 = last / 36, t2 = last / 9, t3 = last / 4, t4 = last / 2.25f, t5 = last / 1.44f;
    const float b1 = blinnPeakBound(exponent, thetaO, 0, t1), b2 = blinnPeakBound(exponent, thetaO, t1, t2),
                b3 = blinnPeakBound(exponent, thetaO, t2, t3), b4 = blinnPeakBound(exponent, thetaO, t3, t4),
                b5 = blinnPeakBound(exponent, thetaO, t4, t5),
                b6 = blinnPeakBound(exponent, thetaO, t5, last);
    const float bound = std::max(std::max(std::max(b1, b2), std::max(b3, b4)), std::max(b5, b6));
    return cosO > 0 ? (exponent + 1) / (8 * kPi) * bound * (1 + 1e-4f) : kInfinity;
}

} // namespace strobe
