// Fresnel reflectances of smooth boundaries, unpolarised.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// Reflectance of a boundary for light at |cosine| `cosI` in a medium of index `etaI`, met by one of `etaT`;
/// 1 when it is totally reflected.
inline float fresnelDielectric(float cosI, float etaI, float etaT) {
    const float sin2T = sqr(etaI / etaT) * std::max(0.f, 1 - cosI * cosI);
    const float cosT = safeSqrt(1 - sin2T);
    const float parallel = (etaT * cosI - etaI * cosT) / (etaT * cosI + etaI * cosT);
    const float perpendicular = (etaI * cosI - etaT * cosT) / (etaI * cosI + etaT * cosT);
    // Select, not branch: this is in loops over directions. At cosI = cosT = 0 the quotients are 0/0.
    return sin2T < 1 ? (sqr(parallel) + sqr(perpendicular)) / 2 : 1.f;
}

/// Reflectance of a conductor with index eta + ik (relative to outside) at |cosine| `cosI`: pbrt-v2's
/// approximation, good for eta² + k² well above 1.
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
