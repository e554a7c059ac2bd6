// The "loopsubdiv" shape.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A Loop subdivision surface (subdivideLoop), refined nlevels times to a triangle mesh with vertices and
/// normals on the limit surface. It deforms if "keys" is above 1. Triangles have the texture coordinates
/// (0,0) (1,0) (1,1). The normals are on the side from which the triangles are counter-clockwise; in .pbrt
/// files, as in all versions of pbrt, on the other.
Plugin<Shape> loopSubdivPlugin();

} // namespace strobe
