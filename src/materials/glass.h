// The "glass" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// A smooth boundary between two dielectrics: specular reflection and refraction by the exact Fresnel
/// equations. The shading normal points to the outside. Transmitted radiance is scaled by the square of the
/// relative index of refraction, except under the conventions of pbrt-v2, which omits the factor. Roughness
/// is not supported: a value other than 0 is a warning, and the boundary renders smooth.
Plugin<std::shared_ptr<const Material>> glassPlugin();

} // namespace strobe
