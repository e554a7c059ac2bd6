// The "distant" light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// Parallel light in direction `to` - `from`, given in light space. L is the irradiance (W/m²) of a surface
/// that faces the light; pbrt calls it radiance, times a delta distribution of directions. Samples have
/// pdf 1. pbrt-v4's "illuminance" replaces the magnitude of L.
Plugin<std::shared_ptr<Light>, const LightArgs&> distantLightPlugin();

} // namespace strobe
