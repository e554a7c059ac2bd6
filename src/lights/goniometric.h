// The "goniometric" light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// A point light at the origin of light space whose radiant intensity I (W/sr) is scaled by an image over the
/// directions: a latitude-longitude image, or a square equal-area map (pbrt-v4), with y up. Samples have pdf
/// 1. pbrt-v4's "power" (W) replaces the magnitude of I.
Plugin<std::shared_ptr<Light>, const LightArgs&> goniometricLightPlugin();

} // namespace strobe
