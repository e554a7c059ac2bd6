// A shining triangle mesh, still, moving or deforming.
#pragma once

#include "lights/emission.h"

namespace strobe {

/// A light over a mesh: a triangle is drawn by its area (for deforming meshes: by the mean of its areas over
/// the shutter), then a point uniform by area on the triangle as it stands at the sample's time.
std::shared_ptr<SurfaceLight> makeMeshLight(const PlacedShape& shape, const Emission& emission);

} // namespace strobe
