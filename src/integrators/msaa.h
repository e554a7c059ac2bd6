// Multisampling: a pixel's samples that hit the same primitive share a shade.
#pragma once

#include "integrators/supersample.h"

namespace strobe {

/// Algorithm 1 of "Multisampling and Motion Blur in a Ray Tracer".
IntegratorPlugin msaaPlugin();

} // namespace strobe
