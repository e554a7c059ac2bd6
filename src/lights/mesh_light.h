// Area lights on triangle meshes, which may move or deform.
#pragma once

#include "lights/emission.h"

namespace strobe {

/// Creates a light on a mesh. A sample picks a triangle with probability proportional to its world-space area
/// (moving and deforming meshes: to the mean area over the shutter), then a point uniform by area on the
/// triangle at the time of the sample. The pdf is per solid angle.
std::shared_ptr<SurfaceLight> makeMeshLight(const PlacedShape& shape, const Emission& emission);

} // namespace strobe
