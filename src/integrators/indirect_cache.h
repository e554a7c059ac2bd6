// Decoupled indirect light: each sample has its own direct light, and interpolates indirect light between
// shared shading points.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

/// Splits radiance into two components (LightComponent). Direct light has most edges and costs little: each
/// visibility sample estimates its own. Indirect light is smooth and costs most: it is shaded at the points
/// of a coarse lattice and interpolated, as in irradiance caching (Ward et al., "A Ray Tracing Solution for
/// Diffuse Interreflection", 1988), but at points that depend on their key alone. The albedo of textures is
/// divided out at the points and multiplied at the samples. Materials without a diffuse component are not
/// shared.
IntegratorPlugin indirectCachePlugin();

} // namespace strobe
