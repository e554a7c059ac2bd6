// "trianglemesh": triangles from numbers in the scene file.
#pragma once

#include "core/plugin.h"
#include "core/shape.h"

namespace strobe {

/// The table row of the triangle mesh; deforming when "keys" is above 1.
Plugin<Shape> triangleMeshPlugin();

} // namespace strobe
