// How large cells are beside their surfaces.
#pragma once

#include "sharing/cell_pyramid.h"

namespace strobe {

/// Returns, for each recorded cell, the number of generations from its node to the first node whose edge is
/// at least a fourth of the extent of the surface, at most CellPyramid::kScales. The extent is the longest
/// edge of the axis-aligned box around all recorded cells of the surface.
HugeVector<uint8_t> surfaceScales(const CellPyramid& pyramid);

} // namespace strobe
