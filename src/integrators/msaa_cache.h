// Decoupled shading: samples of all pixels and times interpolate between shared shading points.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

/// Algorithm 2 of "Multisampling and Motion Blur in a Ray Tracer". By default, instead of the paper's blocks,
/// points of a SurfaceLattice, whose values do not depend on the order in which threads render.
IntegratorPlugin msaaCachePlugin();

} // namespace strobe
