// Area lights on quadrics, sampled by area.
#pragma once

#include "lights/emission.h"

namespace strobe {

/// Creates a light on a quadric under any transform. Samples are uniform by area in object space; the pdf,
/// per solid angle, includes the area scale of the transform at each point.
std::shared_ptr<SurfaceLight> makeQuadricLight(const PlacedShape& shape, const Emission& emission);

} // namespace strobe
