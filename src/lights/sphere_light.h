// Area lights on spheres, sampled by the cone of directions that they subtend.
#pragma once

#include "lights/emission.h"

namespace strobe {

/// Creates a light on a sphere for which isSphereAtAllTimes holds. From outside, directions are sampled
/// uniformly over the cone that the sphere subtends; from inside, uniformly over all directions. The pdf is
/// per solid angle.
std::shared_ptr<SurfaceLight> makeSphereLight(const PlacedShape& shape, const Emission& emission);
/// Returns true if the shape is a full sphere in world space at all times.
bool isSphereAtAllTimes(const PlacedShape& shape);

} // namespace strobe
