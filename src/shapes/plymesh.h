// "plymesh": triangles from PLY files.
#pragma once

#include "core/plugin.h"
#include "core/shape.h"

namespace strobe {

/// The table row of the PLY mesh; several file names are the keys of a deforming mesh.
Plugin<Shape> plyMeshPlugin();

} // namespace strobe
