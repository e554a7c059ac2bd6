// Rectangles of pixels.
#pragma once

namespace strobe {

/// The pixels x0 <= x < x1, y0 <= y < y1 of the full frame: a crop, a tile, or the data window of an image.
struct PixelBounds {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
    bool operator==(const PixelBounds&) const = default;
};

} // namespace strobe
