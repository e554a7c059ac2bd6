// Inputs of pbrt's materials, converted for the materials of strobe.
#pragma once

#include "core/params/plugin.h"

#include <functional>

namespace strobe {

/// Returns f(in), as a texture if the input is one.
FloatInput mapped(const FloatInput& in, std::function<float(float)> f);
RgbInput mapped(const RgbInput& in, std::function<Rgb(const Rgb&)> f);
FloatInput toGray(const RgbInput& in, std::function<float(const Rgb&)> f);
/// Returns f(a, b), as a texture if one of the inputs is one.
RgbInput combined(const RgbInput& a, const RgbInput& b, std::function<Rgb(const Rgb&, const Rgb&)> f);
FloatInput combined(const FloatInput& a, const FloatInput& b, std::function<float(float, float)> f);

/// Returns the mean luminance; of a texture, the mean over its unit square.
float meanOf(const RgbInput& in);
float meanOf(const FloatInput& in);

/// The mapping of roughness to the alpha of a microfacet distribution, by version of pbrt.
enum class RoughnessRule {
    BlinnExponent, ///< v2: the Blinn exponent is 1/roughness; alpha gives the same peak value
    Polynomial,    ///< v3, unless remaproughness is false
    SquareRoot     ///< v4, unless remaproughness is false
};

/// The parameters of a roughness: isotropic, along u, along v, and whether they are remapped.
struct RoughnessDefs {
    ParamDef<FloatInput> both, u, v;
    ParamDef<bool> remap{"remaproughness", true,
                         "whether to map roughness to alpha; false: roughness is alpha"};
};
/// Returns the isotropic roughness of "metallicroughness", the square root of alpha. Of two different
/// roughnesses along u and v, alpha is the geometric mean.
FloatInput readRoughness(const ParamSet& params, const RoughnessDefs& defs, RoughnessRule rule);

/// Returns an index of refraction given as a number, a texture, or a spectrum (v4), whose mean is used.
FloatInput readIndex(const ParamSet& params, const ParamDef<FloatInput>& def);

/// Returns the reflectance of a conductor at normal incidence.
Rgb conductorReflectance(const Rgb& eta, const Rgb& k);

} // namespace strobe
