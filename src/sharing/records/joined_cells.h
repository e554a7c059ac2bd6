// The cells of several tiles as one list.
#pragma once

#include "core/util/memory.h"
#include "sharing/records/light_cells.h"

#include <span>

namespace strobe {

/// A cell of a frame.
struct JoinedCell {
    CellId id; ///< that of the sums
    const CellSums* sums;
};

/// The cells of several tiles.
struct JoinedCells {
    HugeBuffer<JoinedCell> cells;               ///< in the order of `precedes`
    std::vector<std::vector<uint32_t>> numbers; ///< indices in `cells`, by tile and by the index in the tile
};

/// Joins the cells of tiles. Adds up those with equal ids in place, to save memory: the result points to one
/// cell of each id, and the others are not used any more.
JoinedCells joinCells(std::span<const std::span<CellSums>> tiles);

} // namespace strobe
