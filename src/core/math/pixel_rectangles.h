// Sets of pixels as rectangles.
#pragma once

#include "core/math/pixel_bounds.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace strobe {

/// Returns disjoint rectangles of the pixels of `bounds` for which contains(x, y) is true: runs of pixels in
/// a row; equal runs in successive rows are one rectangle.
template <class Contains>
std::vector<PixelBounds> rectanglesOf(const PixelBounds& bounds, const Contains& contains) {
    std::vector<PixelBounds> rectangles;
    std::vector<size_t> above; // rectangles that include the previous row
    for (int y = bounds.y0; y < bounds.y1; ++y) {
        std::vector<size_t> current;
        for (int x = bounds.x0; x < bounds.x1;) {
            int end = x;
            while (end < bounds.x1 && contains(end, y))
                ++end;
            if (end > x) {
                const auto same = std::find_if(above.begin(), above.end(), [&](size_t i) {
                    return rectangles[i].x0 == x && rectangles[i].x1 == end;
                });
                current.push_back(same != above.end() ? *same : rectangles.size());
                if (same == above.end())
                    rectangles.push_back({x, y, end, y});
                rectangles[current.back()].y1 = y + 1;
            }
            x = end + 1;
        }
        above = std::move(current);
    }
    return rectangles;
}

} // namespace strobe
