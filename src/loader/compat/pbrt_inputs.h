// Inputs of foreign materials, brought into the form that ours take.
#pragma once

#include "core/params/plugin.h"

#include <functional>

namespace strobe {

/// f of the input, wherever it is looked up.
FloatInput mapped(const FloatInput& in, std::function<float(float)> f);
RgbInput mapped(const RgbInput& in, std::function<Rgb(const Rgb&)> f);
FloatInput grayOf(const RgbInput& in, std::function<float(const Rgb&)> f);
/// f of two inputs.
RgbInput combined(const RgbInput& a, const RgbInput& b, std::function<Rgb(const Rgb&, const Rgb&)> f);
FloatInput combined(const FloatInput& a, const FloatInput& b, std::function<float(float, float)> f);

/// The mean luminance, of a texture over its unit square.
float meanOf(const RgbInput& in);
float meanOf(const FloatInput& in);

/// How a pbrt of a version takes roughness to the alpha of a microfacet distribution.
enum class RoughnessRule {
    BlinnExponent, ///< v2: the exponent is 1/roughness; the alpha of as wide a lobe
    Polynomial,    ///< v3, unless remaproughness is false: a fit
    SquareRoot     ///< v4, unless remaproughness is false
};

/// "roughness", "uroughness", "vroughness" and "remaproughness", each behind `prefix`.
struct RoughnessDefs {
    ParamDef<FloatInput> both, u, v;
    ParamDef<bool> remap{"remaproughness", true, "false: the roughness is alpha"};
};
/// The isotropic roughness, in metallic-roughness' sense: the square root of alpha.
FloatInput readRoughness(const ParamSet& params, const RoughnessDefs& defs, RoughnessRule rule);

/// An index of refraction given as a number, a texture or (v4) a spectrum.
FloatInput readIndex(const ParamSet& params, const ParamDef<FloatInput>& def);

/// Reflectance of a conductor at normal incidence.
Rgb conductorReflectance(const Rgb& eta, const Rgb& k);

} // namespace strobe
