// The "glass" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"
#include "materials/roughness.h"

namespace strobe {

/// The inputs of a boundary between two dielectrics.
struct GlassInputs {
    RgbInput kr{Rgb(1)}, kt{Rgb(1)}; ///< scales of reflected and of transmitted light
    FloatInput index{1.5f};          ///< index of refraction of the inside relative to the outside
    FloatInput uRoughness{0}, vRoughness{0};
    RoughnessRule rule = RoughnessRule::Alpha; ///< how the roughnesses give alpha along dp/du and dp/dv
    bool scalesRadiance = true; ///< transmitted radiance is scaled by the square of the relative index
};

/// Creates the boundary. Where alpha is below 0.001, or the index is 1, it is smooth: specular reflection and
/// refraction by the exact Fresnel equations. Else, both lobes are those of GGX (Walter et al., "Microfacet
/// Models for Refraction through Rough Surfaces", 2007) with Smith's height-correlated masking, as in pbrt;
/// light that is scattered between microfacets is lost. The shading normal points to the outside.
std::shared_ptr<const Material> makeGlass(const GlassInputs& inputs);

/// The plugin of the scene language. Roughness is mapped by the rule of the file's version of pbrt. Under the
/// conventions of pbrt-v2, transmitted radiance is not scaled.
Plugin<std::shared_ptr<const Material>> glassPlugin();

} // namespace strobe
