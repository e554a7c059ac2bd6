#include "sharing/records/joined_cells.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace strobe {

namespace {

/// Returns a number whose bits are those of the 21 lowest bits of a coordinate, each followed by two zeros.
uint64_t spreadBits(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffff;
    x = (x | x << 16) & 0x001f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

/// Morton codes of the first corners of cells in a grid of 2^21 cubes per axis around the origin. In the
/// order of `precedes`, the codes of a surface do not fall. Most cells that differ have different codes.
class MortonGrid {
  public:
    explicit MortonGrid(std::span<const std::span<const CellSums>> tiles) {
        std::vector<int> levels(tiles.size(), std::numeric_limits<int>::min());
        parallelFor(tiles.size(), [&](size_t tile) {
            for (const CellSums& cell : tiles[tile])
                levels[tile] = std::max(levels[tile], levelOf(cell.id));
        });
        for (const int level : levels)
            m_level = std::max(m_level, level);
    }
    uint64_t codeOf(const CellId& id) const {
        const auto bits = [&](int32_t x) {
            const int shift = m_level - id.level;
            const int32_t cube = shift >= 0 ? x >> std::min(shift, 31) : x << -shift;
            return spreadBits(uint32_t(cube + kHalfWidth));
        };
        return bits(id.x) << 2 | bits(id.y) << 1 | bits(id.z);
    }

  private:
    static constexpr int kBits = 20, kHalfWidth = 1 << kBits;
    /// Returns the smallest level of a grid that contains the cell.
    static int levelOf(const CellId& id) {
        const auto size = [](int32_t x) { return uint32_t(x < 0 ? ~x : x); };
        return id.level + std::bit_width(size(id.x) | size(id.y) | size(id.z)) - kBits;
    }
    int m_level = std::numeric_limits<int>::min();
};

JoinedCell toFloats(const CellSums& sums) {
    JoinedCell out;
    const CellId& id = out.id = sums.id;
    const double edge = std::ldexp(1.0, id.level), unit = 1.0 / (1 << CellSums::kPositionBits);
    double total = 0;
    for (int half = 0; half < kHalves; ++half) {
        out.count[half] = float(sums.count[half]);
        total += double(out.count[half]);
        for (int part = 0; part < kParts; ++part)
            out.light[part][half] = sums.light[part][half].value();
    }
    out.p = V3f(float((id.x * total + double(sums.p[0]) * unit) * edge),
                float((id.y * total + double(sums.p[1]) * unit) * edge),
                float((id.z * total + double(sums.p[2]) * unit) * edge));
    out.n =
        V3f(float(sums.n[0]), float(sums.n[1]), float(sums.n[2])) * (1.f / float(1 << CellSums::kNormalBits));
    return out;
}

/// A cell of a tile, and its place in the order. Keys are sorted in place of cells, as they are smaller.
struct Key {
    uint64_t surface, code; ///< see MortonGrid
    const CellId* id;
    uint32_t tile, index; ///< in the tile

    bool operator<(const Key& other) const {
        if (surface != other.surface)
            return surface < other.surface;
        return code != other.code ? code < other.code : precedes(*id, *other.id);
    }
};

/// Sorts the cells of tiles in parts: ranges of the order, each of some thousand cells.
class CellSorter {
  public:
    explicit CellSorter(std::span<const std::span<const CellSums>> tiles)
        : m_tiles(tiles), m_grid(tiles), m_bounds(findBounds()), m_parts(m_bounds.size() + 1) {
        collect();
        parallelFor(m_parts.size(), [&](size_t part) { sort(m_parts[part]); });
    }
    JoinedCells join() const {
        JoinedCells out;
        out.numbers.resize(m_tiles.size());
        for (size_t tile = 0; tile < m_tiles.size(); ++tile)
            out.numbers[tile].resize(m_tiles[tile].size());
        std::vector<size_t> first; // cell of each part
        size_t count = 0;
        for (const Part& part : m_parts) {
            first.push_back(count);
            count += part.cells;
        }
        out.cells.resize(count);
        parallelFor(m_parts.size(), [&](size_t part) { joinPart(m_parts[part], first[part], out); });
        return out;
    }

  private:
    struct Part {
        std::span<Key> keys; ///< sorted
        size_t cells = 0;    ///< different ids
    };
    Key keyOf(size_t tile, size_t index) const {
        const CellId& id = m_tiles[tile][index].id;
        return {id.surface, m_grid.codeOf(id), &id, uint32_t(tile), uint32_t(index)};
    }
    /// Returns the first keys of all parts but the first one.
    std::vector<Key> findBounds() const {
        constexpr size_t kStride = 64, kKeysOfPart = 4096;
        std::vector<Key> some, bounds;
        for (size_t tile = 0; tile < m_tiles.size(); ++tile)
            for (size_t i = kStride / 2; i < m_tiles[tile].size(); i += kStride)
                some.push_back(keyOf(tile, i));
        std::sort(some.begin(), some.end());
        for (size_t i = kKeysOfPart / kStride; i < some.size(); i += kKeysOfPart / kStride)
            if (bounds.empty() || bounds.back() < some[i])
                bounds.push_back(some[i]);
        return bounds;
    }
    /// Sets Part::keys, not sorted yet.
    void collect() {
        struct TileKeys {
            std::vector<Key> keys;
            std::vector<uint32_t> parts;  ///< by key
            std::vector<uint32_t> counts; ///< by part
        };
        std::vector<TileKeys> tiles(m_tiles.size());
        parallelFor(tiles.size(), [&](size_t number) {
            TileKeys& tile = tiles[number];
            const size_t count = m_tiles[number].size();
            tile.keys.reserve(count);
            tile.parts.reserve(count);
            tile.counts.resize(m_parts.size());
            for (size_t i = 0; i < count; ++i) {
                const Key& key = tile.keys.emplace_back(keyOf(number, i));
                const auto part = std::upper_bound(m_bounds.begin(), m_bounds.end(), key) - m_bounds.begin();
                tile.parts.push_back(uint32_t(part));
                ++tile.counts[size_t(part)];
            }
        });
        std::vector<size_t> ends; // of the parts
        size_t count = 0;
        for (size_t part = 0; part < m_parts.size(); ++part) {
            for (TileKeys& tile : tiles) // counts become the positions of the next keys
                count += std::exchange(tile.counts[part], uint32_t(count));
            ends.push_back(count);
        }
        m_keys.resize(count);
        parallelFor(tiles.size(), [&](size_t number) {
            TileKeys tile = std::move(tiles[number]);
            for (size_t i = 0; i < tile.keys.size(); ++i)
                m_keys[tile.counts[tile.parts[i]]++] = tile.keys[i];
        });
        for (size_t part = 0; part < m_parts.size(); ++part) {
            const size_t first = part > 0 ? ends[part - 1] : 0;
            m_parts[part].keys = {m_keys.data() + first, ends[part] - first};
        }
    }
    static void sort(Part& part) {
        std::sort(part.keys.begin(), part.keys.end());
        for (size_t i = 0; i < part.keys.size(); ++i)
            part.cells += i == 0 || part.keys[i - 1] < part.keys[i];
    }
    /// Adds up the cells of a part. `next`: the index of its first cell.
    void joinPart(const Part& part, size_t next, JoinedCells& out) const {
        for (size_t first = 0, end = 0; first < part.keys.size(); first = end, ++next) {
            CellSums sums;
            sums.id = *part.keys[first].id;
            for (; end < part.keys.size() && !(part.keys[first] < part.keys[end]); ++end) {
                const Key& key = part.keys[end];
                sums.add(m_tiles[key.tile][key.index]);
                out.numbers[key.tile][key.index] = uint32_t(next);
            }
            out.cells[next] = toFloats(sums);
        }
    }

    const std::span<const std::span<const CellSums>> m_tiles;
    const MortonGrid m_grid;
    const std::vector<Key> m_bounds;
    std::vector<Part> m_parts;
    HugeBuffer<Key> m_keys; ///< by part
};

} // namespace

JoinedCells joinCells(std::span<const std::span<const CellSums>> tiles) { return CellSorter(tiles).join(); }

} // namespace strobe
