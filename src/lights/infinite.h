// The environment light.
#pragma once

#include "core/light.h"
#include "core/plugin.h"

namespace strobe {

/// "infinite": light from all directions, constant or from a latitude-longitude map: u = φ/2π, v = θ/π around
/// +z of light space.
Plugin<std::shared_ptr<Light>, const LightArgs&> infiniteLightPlugin();

} // namespace strobe
