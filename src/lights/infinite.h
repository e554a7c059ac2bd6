// The environment light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// "infinite": light from all directions, constant or from a latitude-longitude map: u = φ/2π, v = θ/π around
/// +z of light space.
Plugin<std::shared_ptr<Light>, const LightArgs&> infiniteLightPlugin();

} // namespace strobe
