// The "projection" light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// A slide projector at the origin of light space that looks along +z. Its radiant intensity is I (W/sr)
/// times the image, which covers `fov` degrees along its shorter side. The first row of the image is on the
/// side of +y; in files of pbrt-v2 and v3, on that of -y. Samples have pdf 1. pbrt-v4's "power" (W) replaces
/// the magnitude of I.
Plugin<std::shared_ptr<Light>, const LightArgs&> projectionLightPlugin();

} // namespace strobe
