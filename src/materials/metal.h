// pbrt-v2's metal: Torrance-Sparrow with a Blinn distribution and the Fresnel term of a conductor.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> metalPlugin();

} // namespace strobe
