// Inputs of pbrt's materials, converted for the materials of strobe.
#pragma once

#include "core/params/plugin.h"
#include "materials/roughness.h"

#include <functional>
#include <optional>

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

/// The parameters of a roughness: isotropic, along u, along v, and whether they are remapped.
struct RoughnessDefs {
    ParamDef<FloatInput> both, u, v;
    ParamDef<bool> remap{"remaproughness", true,
                         "whether to map roughness to alpha; false: roughness is alpha"};
};
/// A roughness of "metallicroughness", the square root of alpha.
struct Roughness {
    FloatInput u;                                      ///< along dp/du, or in all directions
    std::optional<FloatInput> v;                       ///< along dp/dv, if it differs
    Roughness(FloatInput both) : u(std::move(both)) {} // NOLINT: implicit
    Roughness(FloatInput alongU, std::optional<FloatInput> alongV)
        : u(std::move(alongU)), v(std::move(alongV)) {}
    /// Returns the isotropic roughness whose lobe covers the same solid angle.
    FloatInput mean() const;
};
Roughness readRoughness(const ParamSet& params, const RoughnessDefs& defs, RoughnessRule rule);

/// Returns an index of refraction given as a number, a texture, or a spectrum (v4), whose mean is used.
FloatInput readIndex(const ParamSet& params, const ParamDef<FloatInput>& def);

/// Returns the reflectance of a conductor at normal incidence.
Rgb conductorReflectance(const Rgb& eta, const Rgb& k);

} // namespace strobe
