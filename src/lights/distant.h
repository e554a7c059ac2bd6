// The distant light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// "distant": parallel light of radiance L times a delta distribution, coming from `from` and going to `to`.
Plugin<std::shared_ptr<Light>, const LightArgs&> distantLightPlugin();

} // namespace strobe
