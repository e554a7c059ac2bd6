// "trianglemesh": triangles from numbers in the scene file.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// The table row of the triangle mesh; deforming when "keys" is above 1.
Plugin<Shape> triangleMeshPlugin();

} // namespace strobe
