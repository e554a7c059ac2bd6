// The mapping of roughness parameters to the alpha of GGX.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// How a roughness gives alpha, by version of pbrt.
enum class RoughnessRule {
    Alpha,         ///< it is alpha (remaproughness false)
    BlinnExponent, ///< v2: the Blinn exponent is 1/roughness; alpha gives the same peak value
    Polynomial,    ///< v3
    SquareRoot,    ///< v4: alpha is the square root of the roughness
};

/// Returns alpha, at most 1, for a roughness; negative roughnesses count as 0.
inline float alphaOf(float roughness, RoughnessRule rule) {
    const float r = std::max(roughness, 0.f);
    float alpha = r;
    if (rule == RoughnessRule::BlinnExponent) {
        alpha = std::sqrt(2 * r / (1 + 2 * r)); // sqrt(2 / (exponent + 2))
    } else if (rule == RoughnessRule::Polynomial) {
        const float x = std::log(std::max(r, 1e-3f));
        alpha = 1.62142f + x * (0.819955f + x * (0.1734f + x * (0.0171201f + x * 0.000640711f)));
    } else if (rule == RoughnessRule::SquareRoot) {
        alpha = std::sqrt(r);
    }
    return std::min(alpha, 1.f);
}

} // namespace strobe
