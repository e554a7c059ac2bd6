// The "point" light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// Emits the radiant intensity I (W/sr) in all directions from a point `from` in light space. Samples have
/// pdf 1. pbrt-v4's "power" (W) replaces the magnitude of I.
Plugin<std::shared_ptr<Light>, const LightArgs&> pointLightPlugin();

} // namespace strobe
