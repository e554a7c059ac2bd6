// The "trianglemesh" shape.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A triangle mesh given by the parameters of the scene file, with pbrt's parametrization: uv is interpolated
/// from the vertices; without "uv" each triangle has (0,0) (1,0) (1,1). It deforms if "keys" is above 1.
Plugin<Shape> triangleMeshPlugin();

} // namespace strobe
