// Numbers of samples that differ by pixel.
#pragma once

#include "core/math/api.h"
#include "core/math/pixel_bounds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace STROBE_API strobe {

/// The factors by which blocks of pixels multiply RenderSettings::samplesPerPixel. A slice of the samples
/// becomes the same fraction of a pixel's samples. Factors are between 1 and 255; outside of the bounds, 1.
class SampleFactors {
  public:
    /// All factors are 1. `blockSize`: a power of two.
    SampleFactors(const PixelBounds& bounds, int blockSize)
        : m_bounds(bounds), m_shift(std::countr_zero(unsigned(blockSize))),
          m_columns((bounds.width() + blockSize - 1) / blockSize),
          m_rows((bounds.height() + blockSize - 1) / blockSize),
          m_factors(size_t(m_columns) * size_t(m_rows), 1) {}

    const PixelBounds& bounds() const { return m_bounds; }
    int columns() const { return m_columns; } ///< of blocks
    int rows() const { return m_rows; }       ///< of blocks
    /// The factors of the blocks, row by row.
    std::vector<uint8_t>& factors() { return m_factors; }
    const std::vector<uint8_t>& factors() const { return m_factors; }

    /// Returns the index of the block of a pixel within the bounds.
    size_t blockOf(int x, int y) const {
        return (size_t(y - m_bounds.y0) >> m_shift) * size_t(m_columns) +
               (size_t(x - m_bounds.x0) >> m_shift);
    }
    /// Returns the factor of a pixel.
    uint32_t at(int x, int y) const {
        const bool isInside = x >= m_bounds.x0 && x < m_bounds.x1 && y >= m_bounds.y0 && y < m_bounds.y1;
        return isInside ? m_factors[blockOf(x, y)] : 1u;
    }
    /// Returns the factors in a tile, in ascending order.
    std::vector<uint32_t> in(const PixelBounds& tile) const {
        std::array<bool, 256> isUsed{};
        const PixelBounds inside{std::max(tile.x0, m_bounds.x0), std::max(tile.y0, m_bounds.y0),
                                 std::min(tile.x1, m_bounds.x1), std::min(tile.y1, m_bounds.y1)};
        isUsed[1] = inside != tile;
        for (int y = inside.y0; y < inside.y1; y = nextBlock(y, m_bounds.y0))
            for (int x = inside.x0; x < inside.x1; x = nextBlock(x, m_bounds.x0))
                isUsed[m_factors[blockOf(x, y)]] = true;
        std::vector<uint32_t> out;
        for (uint32_t factor = 1; factor < isUsed.size(); ++factor)
            if (isUsed[factor])
                out.push_back(factor);
        return out;
    }

  private:
    /// Returns the first position of the next block.
    int nextBlock(int position, int first) const {
        return first + ((((position - first) >> m_shift) + 1) << m_shift);
    }

    PixelBounds m_bounds;
    int m_shift; ///< blocks have 2^m_shift pixels per edge
    int m_columns, m_rows;
    std::vector<uint8_t> m_factors;
};

} // namespace strobe
