// How large cells are beside their surfaces.
#pragma once

#include "sharing/cell_pyramid.h"

namespace strobe {

/// Returns, for each recorded cell, the number of generations from its node to the first one whose cube has
/// an edge of at least a fourth of the surface: of the longest edge of the box, along the axes, around all
/// recorded cells of the surface. At most CellPyramid::kScales.
HugeVector<uint8_t> surfaceScales(const CellPyramid& pyramid);

} // namespace strobe
