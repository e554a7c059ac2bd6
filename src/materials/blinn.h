// The Blinn microfacet distribution and Torrance and Sparrow's masking, as pbrt-v2 uses them (Blinn, "Models
// of Light Reflection for Computer Synthesized Pictures", 1977; Torrance & Sparrow 1967). Symmetric under
// (wo, wi) -> (-wo, -wi), so lobes made of them are two-sided.
#pragma once

#include "core/math.h"

namespace strobe {

/// pbrt-v2's exponent of a roughness: 1/roughness, at most (and, for roughness 0, exactly) 10000.
inline float blinnExponent(float roughness) { return 1 / std::max(roughness, 1e-4f); }

/// What all microfacet lobes share for one pair of directions.
struct MicrofacetTerm {
    float shape;   ///< D G / (4 |wo.z|): times the reflectance, this is f |cos wi|
    float cosHalf; ///< wi · wh, the cosine that Fresnel terms take; >= 0
    float pdf;     ///< of sampleBlinn, per solid angle; 0 where it never goes
};

/// D = (e+2)/2π |cos θh|^e and pdf = (e+1)/2π |cos θh|^e / (4 wo·wh), for unit wo and wi.
inline MicrofacetTerm evalBlinn(float exponent, const V3f& wo, const V3f& wi) {
    const V3f sum = wo + wi;
    const float l2 = length2(sum); // (2 wo·wh)²
    // wo = -wi has no half vector; the pair carries nothing, and neither does a viewer exactly on the
    // horizon.
    if (!(l2 > 1e-14f) || wo.z == 0)
        return {0, 0, 0};
    const float l = std::sqrt(l2), cosHalf = std::min(l / 2, 1.f), cosO = std::abs(wo.z),
                cosI = std::abs(wi.z);
    const float cosThetaH = std::min(std::abs(sum.z) / l, 1.f);
    const float lobe = std::pow(cosThetaH, exponent) / (2 * kPi);
    const float masking = std::min(1.f, 2 * cosThetaH * std::min(cosO, cosI) / cosHalf);
    const bool reachable = wo.z * wi.z > 0;
    return {(exponent + 2) * lobe * masking / (4 * cosO), cosHalf,
            reachable ? (exponent + 1) * lobe / (4 * cosHalf) : 0.f};
}

/// Draws wi by reflecting wo at a half vector of density (e+1)/2π cos^e (u in [0,1)²) on wo's side. False: wi
/// lies below the horizon, the sample is absorbed.
bool sampleBlinn(float exponent, const V3f& wo, const V2f& u, V3f& wi);

/// An upper bound of evalBlinn's pdf over all wi, given wo. Infinite for wo.z = 0.
float maxBlinnPdf(float exponent, const V3f& wo);

} // namespace strobe
