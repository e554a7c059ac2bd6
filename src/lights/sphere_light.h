// A shining sphere, sampled by the cone in which it is seen.
#pragma once

#include "lights/emission.h"

namespace strobe {

/// A light over a whole sphere that stays a sphere in the world: uniform over the cone it fills from outside,
/// and over all directions from inside (where every direction meets it).
std::shared_ptr<SurfaceLight> makeSphereLight(const PlacedShape& shape, const Emission& emission);
/// True when the shape is a whole sphere, and stays one under its transforms at all times.
bool staysSphere(const PlacedShape& shape);

} // namespace strobe
