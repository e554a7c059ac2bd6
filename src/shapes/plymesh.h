// "plymesh": triangles from PLY files.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// The table row of the PLY mesh; several file names are the keys of a deforming mesh.
Plugin<Shape> plyMeshPlugin();

} // namespace strobe
