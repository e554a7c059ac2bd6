// The "metal" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// pbrt-v2's metal: a two-sided Torrance-Sparrow lobe with the Blinn distribution (evalBlinn) and the
/// approximate Fresnel reflectance of a conductor (fresnelConductor). The Blinn exponent is 1/roughness.
Plugin<std::shared_ptr<const Material>> metalPlugin();

} // namespace strobe
