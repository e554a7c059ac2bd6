// The spot light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// "spot": a point light that shines into a cone, with a soft rim inside it.
Plugin<std::shared_ptr<Light>, const LightArgs&> spotLightPlugin();

} // namespace strobe
