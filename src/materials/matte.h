// The "matte" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// Two-sided diffuse reflection, as in pbrt-v2: Lambertian of reflectance Kd, or, if sigma (degrees) is not
/// 0, the qualitative model of Oren and Nayar ("Generalization of Lambert's Reflectance Model", 1994).
/// Directions are sampled by the cosine.
Plugin<std::shared_ptr<const Material>> mattePlugin();

} // namespace strobe
