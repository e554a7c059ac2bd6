// Division of a rectangle of pixels into slices of small tiles, which are spread evenly over the rectangle.
#pragma once

#include "core/math/pixel_bounds.h"

#include <cstdint>
#include <vector>

namespace strobe {

/// A rectangle of pixels whose square tiles belong to `count` slices. The tiles of a slice are points of a
/// lattice whose shortest vector is about as long as possible. Neighboring tiles cost about as much, so that
/// slices with many tiles cost about as much, too.
struct InterleavedTiles {
    PixelBounds window;
    int edge = 1;       ///< of the tiles, in pixels; the last column and row may be smaller
    uint32_t count = 1; ///< of slices, at least 1 and at most the number of tiles

    int columns() const { return (window.width() + edge - 1) / edge; }
    int rows() const { return (window.height() + edge - 1) / edge; }
    uint64_t tileCount() const { return uint64_t(columns()) * uint64_t(rows()); }
    bool operator==(const InterleavedTiles&) const = default;
};

/// The maximum number of slices.
inline constexpr uint32_t kMaxSlices = 1 << 16;

/// Returns the tiles of `count` slices of a window that has at least as many pixels. The edge is at most 32,
/// and each slice has about `tilesPerSlice` tiles or more if there are enough pixels.
InterleavedTiles interleavedTiles(const PixelBounds& window, uint32_t count, uint32_t tilesPerSlice);

/// Returns the tiles of slice number `slice` < tiles.count, row by row; at least one.
std::vector<PixelBounds> tilesOfSlice(const InterleavedTiles& tiles, uint32_t slice);

} // namespace strobe
