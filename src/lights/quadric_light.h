// Any shining quadric, sampled by area.
#pragma once

#include "lights/emission.h"

namespace strobe {

/// A light over a quadric under any transform: uniform by area in object space, with the transform's true
/// stretching of the surface at each point.
std::shared_ptr<SurfaceLight> makeQuadricLight(const PlacedShape& shape, const Emission& emission);

} // namespace strobe
