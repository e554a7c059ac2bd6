// Diffuse reflection and diffuse transmission of a thin wall: paper, leaves, lampshades.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> diffuseTransmissionPlugin();

/// Returns a material with Lambertian lobes on both sides; where the sum of both albedos is above 1, they are
/// scaled to 1.
std::shared_ptr<const Material> makeDiffuseTransmission(RgbInput reflectance, RgbInput transmittance);

} // namespace strobe
