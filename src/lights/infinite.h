// The "infinite" light.
#pragma once

#include "core/image/image.h"
#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

/// Radiance (W/(m² sr)) from all directions, constant or from a latitude-longitude map around +z of light
/// space with u = φ/2π, v = θ/π (EnvironmentMap); under pbrt-v4's conventions a square map is an equal-area
/// map. Sampled by the luminance of the map, or uniformly over the sphere; the pdf is per solid angle. The
/// light does not move: the transform at shutter opening is used (pbrt-v2: the first key). pbrt-v4's
/// "illuminance" replaces the magnitude of L.
Plugin<std::shared_ptr<Light>, const LightArgs&> infiniteLightPlugin();

/// Creates such a light from a map in memory. Preconditions: the map is not empty, its values are finite and
/// not negative, and `toWorld` is not singular. `scale`: factor of the map.
std::shared_ptr<Light> makeEnvironmentLight(const M44f& toWorld, const Rgb& scale, const Image& map);

} // namespace strobe
