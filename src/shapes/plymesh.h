// The "plymesh" shape.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A triangle mesh from a PLY file (readPlyFile), with its normals and texture coordinates. Several files of
/// the same topology are the keys of a deforming mesh; texture coordinates are taken from the first file.
Plugin<Shape> plyMeshPlugin();

} // namespace strobe
