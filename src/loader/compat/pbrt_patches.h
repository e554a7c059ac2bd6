// pbrt-v4's bilinear patches.
#pragma once

#include "loader/compat/pbrt_compat.h"

namespace strobe {

/// Returns the row of "bilinearmesh", which becomes triangles.
ShapeRow bilinearMeshRow();

} // namespace strobe
