#include "core/math/interleaved_tiles.h"

#include <algorithm>
#include <utility>

namespace strobe {

namespace {

/// A vector of integers.
struct Step {
    int64_t x, y;
    int64_t squaredLength() const { return x * x + y * y; }
};

/// Returns the squared length of the shortest vector between points with x + factor * y = 0 modulo count, by
/// Lagrange's reduction of the lattice.
int64_t shortestSquaredLength(int64_t factor, int64_t count) {
    Step a{count, 0}, b{-factor, 1};
    for (;;) {
        if (a.squaredLength() < b.squaredLength())
            std::swap(a, b);
        const int64_t dot = a.x * b.x + a.y * b.y, length = b.squaredLength();
        const int64_t times = (2 * dot + (dot < 0 ? -length : length)) / (2 * length); // rounded
        const Step reduced{a.x - times * b.x, a.y - times * b.y};
        if (reduced.squaredLength() >= a.squaredLength())
            return length;
        a = reduced;
    }
}

uint32_t sliceAt(const InterleavedTiles& tiles, uint32_t factor, int column, int row) {
    return uint32_t((uint64_t(column) + uint64_t(factor) * uint64_t(row)) % tiles.count);
}

/// Whether each slice has a tile.
bool leavesNoneEmpty(const InterleavedTiles& tiles, uint32_t factor) {
    std::vector<bool> has(tiles.count);
    uint32_t found = 0;
    for (int row = 0; row < tiles.rows() && found < tiles.count; ++row)
        for (int column = 0; column < tiles.columns(); ++column) {
            const uint32_t slice = sliceAt(tiles, factor, column, row);
            found += !has[slice];
            has[slice] = true;
        }
    return found == tiles.count;
}

/// Returns the factor of the lattice: the tile at (column, row) belongs to slice column + factor * row modulo
/// count.
uint32_t latticeFactor(const InterleavedTiles& tiles) {
    std::vector<std::pair<int64_t, uint32_t>> factors; // by descending length, then ascending factor
    for (uint32_t factor = 0; factor < tiles.count; ++factor)
        factors.emplace_back(-shortestSquaredLength(factor, tiles.count), factor);
    std::sort(factors.begin(), factors.end());
    constexpr size_t kMaxTried = 64;
    for (size_t i = 0; i < std::min(factors.size(), kMaxTried); ++i)
        if (leavesNoneEmpty(tiles, factors[i].second))
            return factors[i].second;
    return uint32_t(tiles.columns()) % tiles.count; // row by row
}

} // namespace

InterleavedTiles interleavedTiles(const PixelBounds& window, uint32_t count, uint32_t tilesPerSlice) {
    InterleavedTiles tiles{window, 32, count};
    while (tiles.edge > 1 && tiles.tileCount() < uint64_t(tilesPerSlice) * count)
        tiles.edge /= 2;
    return tiles;
}

std::vector<PixelBounds> tilesOfSlice(const InterleavedTiles& tiles, uint32_t slice) {
    const uint32_t factor = latticeFactor(tiles);
    const PixelBounds& window = tiles.window;
    std::vector<PixelBounds> out;
    for (int row = 0; row < tiles.rows(); ++row)
        for (int column = 0; column < tiles.columns(); ++column)
            if (sliceAt(tiles, factor, column, row) == slice) {
                const int x = window.x0 + column * tiles.edge, y = window.y0 + row * tiles.edge;
                out.push_back(
                    {x, y, std::min(x + tiles.edge, window.x1), std::min(y + tiles.edge, window.y1)});
            }
    return out;
}

} // namespace strobe
