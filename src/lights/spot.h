// The "spot" light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// A point light at `from` that emits into a cone around the direction to `to` (light space): radiant
/// intensity I (W/sr) within coneangle - conedeltaangle (degrees) of the axis, falling to 0 at coneangle. The
/// falloff is a polynomial of the cosine: quartic in pbrt-v2 and v3, smoothstep in pbrt-v4, squared in glTF.
/// Samples have pdf 1. pbrt-v4's "power" (W) replaces the magnitude of I.
Plugin<std::shared_ptr<Light>, const LightArgs&> spotLightPlugin();

} // namespace strobe
