// Multisampling: samples of a pixel that hit the same primitive share a shade.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

/// Algorithm 1 of "Multisampling and Motion Blur in a Ray Tracer".
IntegratorPlugin msaaPlugin();

} // namespace strobe
