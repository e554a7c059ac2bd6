// The point light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// "point": the same intensity I in all directions, from one point.
Plugin<std::shared_ptr<Light>, const LightArgs&> pointLightPlugin();

} // namespace strobe
