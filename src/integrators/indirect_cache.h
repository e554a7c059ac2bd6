// Decoupled indirect light: direct light for every sample, the smooth and dear rest for many samples
// together.
#pragma once

#include "integrators/supersample.h"

namespace strobe {

/// Splits radiance in two (LightComponent). Direct light has the edges and costs little: each visibility
/// sample estimates its own. Indirect light is smooth and costs most: it is shaded at the points of a coarse
/// lattice on the surfaces and interpolated (as irradiance caching does; Ward et al., "A Ray Tracing Solution
/// for Diffuse Interreflection", 1988), here on points that depend on their key alone; textures are divided
/// out and put back. Materials without a diffuse part share nothing.
IntegratorPlugin indirectCachePlugin();

} // namespace strobe
