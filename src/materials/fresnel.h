// Fresnel reflectances of smooth boundaries for unpolarized light.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// Returns the reflectance of a dielectric boundary for light in a medium of index `etaI` that arrives at a
/// medium of index `etaT`; 1 for total internal reflection. `cosI`: |cosine| of the angle of incidence.
inline float fresnelDielectric(float cosI, float etaI, float etaT) {
    const float sin2T = sqr(etaI / etaT) * std::max(0.f, 1 - cosI * cosI);
    const float cosT = safeSqrt(1 - sin2T);
    const float parallel = (etaT * cosI - etaI * cosT) / (etaT * cosI + etaI * cosT);
    const float perpendicular = (etaI * cosI - etaT * cosT) / (etaI * cosI + etaT * cosT);
    // A select, not a branch, for loops over directions. At cosI = cosT = 0 the quotients are 0/0.
    return sin2T < 1 ? (sqr(parallel) + sqr(perpendicular)) / 2 : 1.f;
}

/// Returns the reflectance of a conductor of index eta + ik relative to the outside, by pbrt-v2's
/// approximation, which is accurate for eta² + k² well above 1. `cosI`: |cosine| of the angle of incidence.
inline float fresnelConductor(float cosI, float eta, float k) {
    const float modulus = eta * eta + k * k, cos2 = cosI * cosI, mixed = 2 * eta * cosI;
    const float parallel2 = (modulus * cos2 - mixed + 1) / (modulus * cos2 + mixed + 1);
    const float perpendicular2 = (modulus - mixed + cos2) / std::max(modulus + mixed + cos2, 1e-20f);
    return (parallel2 + perpendicular2) / 2;
}
inline Rgb fresnelConductor(float cosI, const Rgb& eta, const Rgb& k) {
    return {fresnelConductor(cosI, eta.x, k.x), fresnelConductor(cosI, eta.y, k.y),
            fresnelConductor(cosI, eta.z, k.z)};
}

} // namespace strobe
