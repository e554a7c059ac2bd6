#include "materials/blinn.h"

namespace strobe {

bool sampleBlinn(float exponent, const V3f& wo, const V2f& u, V3f& wi) {
    const float cosThetaH = std::pow(1 - u.x, 1 / (exponent + 1)); // 1 - u: never 0
    const float sinThetaH = safeSqrt(1 - cosThetaH * cosThetaH), phi = 2 * kPi * u.y;
    const float side = wo.z < 0 ? -1.f : 1.f;
    const V3f wh(sinThetaH * std::cos(phi), sinThetaH * std::sin(phi), side * cosThetaH);
    const float cosHalf = dot(wo, wh);
    if (cosHalf <= 0)
        return false;
    wi = normalize(wh * (2 * cosHalf) - wo);
    return wi.z * wo.z > 0;
}

float maxBlinnPdf(float exponent, const V3f& wo) {
    // Among half vectors at angle t from the normal, wo·wh is least in the plane of wo, on the far side:
    // cos(thetaO + t). There wi stays above the horizon up to t = (90° - thetaO)/2, and beyond that angle the
    // horizon keeps wo·wh above cosO / (2 cos t), where the pdf only falls. So the maximum is that of
    // cos^e(t) / cos(thetaO + t) over [0, (90° - thetaO)/2], bounded here interval by interval with
    // cos^e(t) <= exp(-e t²/2).
    const float cosO = std::min(std::abs(wo.z), 1.f), thetaO = std::acos(cosO);
    const float last = (kPi / 2 - thetaO) / 2;
    constexpr int kIntervals = 6;
    float bound = 0, left = 0;
    for (int i = 1; i <= kIntervals; ++i) {
        const float right = last * sqr(float(i) / kIntervals);
        const float lowest = std::cos(thetaO + right) * (1 - 1e-4f); // a margin for rounding
        bound = std::max(bound, std::exp(-exponent * left * left / 2) / std::max(lowest, 0.f));
        left = right;
    }
    return (exponent + 1) / (8 * kPi) * bound * (1 + 1e-4f);
}

} // namespace strobe
