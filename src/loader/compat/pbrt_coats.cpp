#include "loader/compat/pbrt_coats.h"

#include "loader/compat/pbrt_inputs.h"
#include "materials/fresnel.h"

namespace strobe {

namespace {

/// Returns the reflectance of a smooth dielectric boundary for diffuse light that arrives from outside: the
/// mean of Fresnel's reflectance over the cosine.
float diffuseFresnel(float eta) {
    constexpr int kSteps = 256;
    float sum = 0;
    for (int i = 0; i < kSteps; ++i) { // uniform in sin²
        const float sin2 = (float(i) + .5f) / kSteps;
        sum += fresnelDielectric(std::sqrt(1 - sin2), 1, eta) / kSteps;
    }
    return sum;
}

} // namespace

RgbInput belowCoat(const RgbInput& reflectance, float eta) {
    const float transmittance = (1 - diffuseFresnel(eta)) / (eta * eta);
    return mapped(reflectance, [transmittance](const Rgb& rho) {
        Rgb out;
        for (int i = 0; i < 3; ++i)
            out[i] = rho[i] * transmittance / (1 - std::min(rho[i], 1.f) * (1 - transmittance));
        return out;
    });
}

RgbInput conductorBelowCoat(const RgbInput& reflectance, float eta, float alpha) {
    const float normal = sqr((eta - 1) / (eta + 1));
    const float diffuse = 1 - (1 - diffuseFresnel(eta)) / (eta * eta);
    const float inside = lerp(normal, diffuse, std::min(alpha, 1.f));
    return mapped(reflectance, [inside](const Rgb& rho) {
        Rgb out;
        for (int i = 0; i < 3; ++i)
            out[i] = rho[i] * (1 - inside) / (1 - std::min(rho[i], 1.f) * inside);
        return out;
    });
}

} // namespace strobe
