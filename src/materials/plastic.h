// pbrt-v2's plastic: Lambertian below a Torrance-Sparrow gloss with a Blinn distribution.
#pragma once

#include "core/material.h"
#include "core/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> plasticPlugin();

} // namespace strobe
