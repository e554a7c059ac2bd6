// pbrt-v2's plastic: Lambertian below a Torrance-Sparrow gloss with a Blinn distribution.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> plasticPlugin();

} // namespace strobe
