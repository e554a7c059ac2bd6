// The "plastic" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// pbrt-v2's plastic: the two-sided sum of a Lambertian lobe of reflectance Kd and a Torrance-Sparrow lobe of
/// scale Ks with the Blinn distribution (evalBlinn). The Blinn exponent is 1/roughness. The values equal
/// those of pbrt-v2, including its Fresnel term for light from inside the dielectric. The probabilities of
/// the lobes differ: pbrt-v2 picks either with probability 1/2, here they follow the lobes' albedos.
Plugin<std::shared_ptr<const Material>> plasticPlugin();

} // namespace strobe
