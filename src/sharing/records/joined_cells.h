// The cells of several tiles as one list.
#pragma once

#include "core/util/memory.h"
#include "sharing/records/light_cells.h"

#include <span>

namespace strobe {

/// The cells of several tiles. Those with equal ids are added up.
struct JoinedCells {
    HugeBuffer<CellSums> cells;                 ///< by ascending id
    std::vector<std::vector<uint32_t>> numbers; ///< indices in `cells`, by tile and by the index in the tile
};

JoinedCells joinCells(std::span<const std::span<const CellSums>> tiles);

} // namespace strobe
