// The "studio" light.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// The surroundings of objects without light of their own: a gray floor that becomes brighter towards the
/// horizon, a sky that becomes darker towards the zenith, and three soft lights: a key light at the upper
/// left front, a fill light at the right, and a rim light behind. +y of light space is up, +z is the front.
/// An environment light of light-to-world space like "infinite".
Plugin<std::shared_ptr<Light>, const LightArgs&> studioLightPlugin();

} // namespace strobe
