// The cells of several tiles as one list.
#pragma once

#include "core/util/memory.h"
#include "sharing/records/light_cells.h"

#include <span>

namespace strobe {

/// A cell of a frame: CellSums as floats.
struct JoinedCell {
    CellId id;
    float count[kHalves];
    V3f p, n; ///< sums over the samples; p: in world space at shutter fraction 0
    Rgb light[kParts][kHalves];
};

/// The cells of several tiles.
struct JoinedCells {
    HugeBuffer<JoinedCell> cells;               ///< in the order of `precedes`
    std::vector<std::vector<uint32_t>> numbers; ///< indices in `cells`, by tile and by the index in the tile
};

/// Joins the cells of tiles, and adds up those with equal ids.
JoinedCells joinCells(std::span<const std::span<const CellSums>> tiles);

} // namespace strobe
