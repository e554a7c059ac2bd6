// Decoupled shading: samples of any pixel and any time share the shading points around them.
#pragma once

#include "integrators/supersample.h"

namespace strobe {

/// Algorithm 2 of "Multisampling and Motion Blur in a Ray Tracer", with blocks whose values do not depend on
/// who asked first.
IntegratorPlugin msaaCachePlugin();

} // namespace strobe
