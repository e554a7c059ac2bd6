// Numbers of samples that differ by pixel.
#pragma once

#include "core/math/api.h"
#include "core/math/pixel_bounds.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace STROBE_API strobe {

/// The factors by which blocks of pixels multiply RenderSettings::samplesPerPixel. A slice of the samples
/// becomes the same fraction of a pixel's samples. A factor of 0 leaves pixels out. Outside of the bounds,
/// factors are 1.
class SampleFactors {
  public:
    /// All factors are 1.
    SampleFactors(const PixelBounds& bounds, int blockSize)
        : m_bounds(bounds), m_blockSize(blockSize), m_columns((bounds.width() + blockSize - 1) / blockSize),
          m_rows((bounds.height() + blockSize - 1) / blockSize),
          m_factors(size_t(m_columns) * size_t(m_rows), 1) {}

    const PixelBounds& bounds() const { return m_bounds; }
    int columns() const { return m_columns; } ///< of blocks
    int rows() const { return m_rows; }       ///< of blocks
    /// The factors of the blocks, row by row.
    std::vector<uint32_t>& factors() { return m_factors; }
    const std::vector<uint32_t>& factors() const { return m_factors; }

    /// Returns the index of the block of a pixel within the bounds.
    size_t blockOf(int x, int y) const {
        return size_t((y - m_bounds.y0) / m_blockSize) * size_t(m_columns) +
               size_t((x - m_bounds.x0) / m_blockSize);
    }
    /// Returns the factor of a pixel.
    uint32_t at(int x, int y) const {
        const bool isInside = x >= m_bounds.x0 && x < m_bounds.x1 && y >= m_bounds.y0 && y < m_bounds.y1;
        return isInside ? m_factors[blockOf(x, y)] : 1;
    }
    /// Returns the factors above 0 in a tile, in ascending order.
    std::vector<uint32_t> in(const PixelBounds& tile) const {
        std::vector<uint32_t> out;
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x)
                if (const uint32_t factor = at(x, y);
                    factor > 0 && std::find(out.begin(), out.end(), factor) == out.end())
                    out.push_back(factor);
        std::sort(out.begin(), out.end());
        return out;
    }

  private:
    PixelBounds m_bounds;
    int m_blockSize, m_columns, m_rows;
    std::vector<uint32_t> m_factors;
};

} // namespace strobe
