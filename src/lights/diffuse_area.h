// The diffuse area light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// "diffuse" (pbrt-v2 also: "area"): radiance L from every point of a shape, in all directions on the side of
/// its normal, or on both.
Plugin<std::shared_ptr<Light>, const AreaLightArgs&> diffuseAreaLightPlugin();

} // namespace strobe
