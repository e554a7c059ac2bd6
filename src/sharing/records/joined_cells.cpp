#include "sharing/records/joined_cells.h"

#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

namespace {

/// The id and the place of a cell. Keys are sorted in place of cells, as they are smaller.
struct Key {
    CellId id;
    uint32_t tile, index; ///< in the tile

    bool operator<(const Key& other) const { return id < other.id; }
};

/// Sorts the cells of tiles in parts: ranges of ids, each of some thousand cells.
class CellSorter {
  public:
    explicit CellSorter(std::span<const std::span<CellSums>> tiles)
        : m_tiles(tiles), m_keysOfTile(tiles.size()) {
        parallelFor(tiles.size(), [&](size_t tile) { sortTile(tile); });
        findBounds();
        m_parts.resize(m_bounds.size() + 1);
        parallelFor(m_parts.size(), [&](size_t part) { collect(part); });
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
        std::vector<Key> keys; ///< by ascending id
        size_t cells = 0;      ///< different ids
    };
    void sortTile(size_t tile) {
        std::vector<Key>& keys = m_keysOfTile[tile];
        keys.reserve(m_tiles[tile].size());
        for (const CellSums& cell : m_tiles[tile])
            keys.push_back({cell.id, uint32_t(tile), uint32_t(keys.size())});
        std::sort(keys.begin(), keys.end());
    }
    /// Sets m_bounds.
    void findBounds() {
        constexpr size_t kStride = 64, kKeysOfPart = 4096;
        std::vector<CellId> some;
        for (const std::vector<Key>& keys : m_keysOfTile)
            for (size_t i = kStride / 2; i < keys.size(); i += kStride)
                some.push_back(keys[i].id);
        std::sort(some.begin(), some.end());
        for (size_t i = kKeysOfPart / kStride; i < some.size(); i += kKeysOfPart / kStride)
            if (m_bounds.empty() || m_bounds.back() < some[i])
                m_bounds.push_back(some[i]);
    }
    /// Copies the keys of a part from all tiles, and sorts them.
    void collect(size_t number) {
        Part& part = m_parts[number];
        const auto find = [](const std::vector<Key>& keys, const CellId& id) {
            return std::lower_bound(keys.begin(), keys.end(), Key{id, 0, 0});
        };
        for (const std::vector<Key>& keys : m_keysOfTile)
            part.keys.insert(part.keys.end(), number > 0 ? find(keys, m_bounds[number - 1]) : keys.begin(),
                             number < m_bounds.size() ? find(keys, m_bounds[number]) : keys.end());
        std::sort(part.keys.begin(), part.keys.end());
        for (size_t i = 0; i < part.keys.size(); ++i)
            part.cells += i == 0 || part.keys[i - 1] < part.keys[i];
    }
    /// Adds up the cells of a part. `next`: the index of its first cell.
    void joinPart(const Part& part, size_t next, JoinedCells& out) const {
        CellSums* sums = nullptr; // of the current id
        for (size_t i = 0; i < part.keys.size(); ++i) {
            const Key& key = part.keys[i];
            CellSums& cell = m_tiles[key.tile][key.index];
            if (i == 0 || part.keys[i - 1] < key) {
                sums = &cell;
                out.cells[next++] = {key.id, sums};
            } else {
                sums->add(cell);
            }
            out.numbers[key.tile][key.index] = uint32_t(next - 1);
        }
    }

    const std::span<const std::span<CellSums>> m_tiles;
    std::vector<std::vector<Key>> m_keysOfTile; ///< by ascending id
    std::vector<CellId> m_bounds;               ///< the first ids of all parts but the first one
    std::vector<Part> m_parts;
};

} // namespace

JoinedCells joinCells(std::span<const std::span<CellSums>> tiles) { return CellSorter(tiles).join(); }

} // namespace strobe
