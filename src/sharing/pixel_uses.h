// The uses of cells, sorted by pixel.
#pragma once

#include "sharing/light_cells.h"

namespace strobe {

/// The uses of cells by pixel. The uses of one pixel keep their order.
class PixelUses {
  public:
    PixelUses(const std::vector<std::vector<CellUse>>& batches, size_t pixels);
    std::span<const CellUse> of(size_t pixel) const {
        return std::span(m_uses).subspan(m_first[pixel], m_first[pixel + 1] - m_first[pixel]);
    }

  private:
    std::vector<uint32_t> m_first; ///< by pixel; and their number
    std::vector<CellUse> m_uses;
};

/// Returns the uses in the order of their pixels, with one entry per pixel, half and cell.
std::vector<CellUse> merged(const std::vector<std::vector<CellUse>>& batches, size_t pixels);

} // namespace strobe
