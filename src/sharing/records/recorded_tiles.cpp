// The functions of RecordedLight that join tiles.
#include "core/util/parallel.h"
#include "sharing/records/recorded_light.h"

#include <algorithm>
#include <memory>
#include <tuple>

namespace strobe {

namespace {

/// Replaces each item i by item indexOf(i), in place. The indices are a permutation; those of moved items
/// become their own.
template <class Items, class IndexOf>
void permute(Items& items, const IndexOf& indexOf) {
    for (uint32_t first = 0; first < items.size(); ++first) {
        if (indexOf(first) == first)
            continue;
        const auto saved = items[first];
        uint32_t i = first;
        for (uint32_t next = indexOf(i); next != first; next = indexOf(i)) {
            items[i] = items[next];
            indexOf(i) = i;
            i = next;
        }
        items[i] = saved;
        indexOf(i) = i;
    }
}

HalfPixelSums toFloats(const HalfLight& light) {
    HalfPixelSums out;
    out.count = light.count();
    out.quarterCount = light.quarters[0].count;
    for (int part = 0; part < kParts; ++part) {
        RgbSum sum = light.quarters[0].light[part];
        out.quarterLight[part] = sum.value();
        sum.add(light.quarters[1].light[part]);
        out.light[part] = sum.value();
    }
    out.emitted = light.emitted.value();
    out.v = float(light.v.value());
    out.ee = float(light.ee.value());
    out.ve = float(light.ve.value());
    return out;
}

/// All that a rare sample holds, by which an order of samples does not depend on that of rendering.
auto keyOf(const PixelRareSample& s) {
    return std::tuple(s.pixel, s.half, s.cell, s.part, s.isInQuarter, s.light.x, s.light.y, s.light.z,
                      s.albedo.x, s.albedo.y, s.albedo.z);
}

} // namespace

RecordedLight::RecordedLight(const PixelBounds& bounds, LightParts recorded)
    : pixelBounds(bounds), parts(recorded) {
    const size_t count = size_t(bounds.width()) * size_t(bounds.height());
    pixels.resize(kHalves * count);
    m_uses.resize(count);
}

void RecordedLight::setPixel(size_t index, PixelLight& light, std::vector<PixelUse>& uses, TileSums& tile) {
    for (int half = 0; half < kHalves; ++half)
        pixels[kHalves * index + size_t(half)] = toFloats(light.halves[half]);
    addUses(index, light, uses, tile);
}

/// Adds the uses and the rare samples of a pixel, with one use per cell and half.
void RecordedLight::addUses(size_t index, PixelLight& light, std::vector<PixelUse>& uses,
                            TileSums& sums) const {
    const size_t first = uses.size();
    for (int half = 0; half < kHalves; ++half) {
        HalfLight& from = light.halves[half];
        sortUses(from.uses);
        for (const CellUse& use : from.uses)
            uses.push_back({use.cell & 0x7fffffffu, uint32_t(half) & 1, use.albedoSum()});
        for (const RareSample& sample : from.rare)
            sums.rare.push_back({sample, uint32_t(index), uint32_t(half)});
    }
    sums.pixels.push_back({index, uses.size() - first});
}

PixelUses copyUses(std::span<const PixelUse> uses, ByteArena& arena) {
    std::shared_ptr<char> memory = arena.allocate(uses.size_bytes());
    auto* const first = reinterpret_cast<PixelUse*>(memory.get());
    std::uninitialized_copy(uses.begin(), uses.end(), first);
    return {{first, uses.size()}, std::move(memory)};
}

void RecordedLight::join(std::vector<TileSums> tiles) {
    size_t cellCount = 0;
    for (const TileSums& tile : tiles)
        cellCount += tile.cells.size();
    const auto numbers = joinCells(tiles.size(), cellCount, [&](size_t i, const auto& work) {
        for (const CellSums& cell : tiles[i].cells)
            work(cell);
    });
    parallelFor(tiles.size(), [&](size_t i) {
        tiles[i].cells = {};
        for (PixelUse& use : tiles[i].uses.uses)
            use.cell = numbers[i][use.cell] & 0x7fffffffu;
        for (PixelRareSample& sample : tiles[i].rare)
            sample.cell = numbers[i][sample.cell];
        const std::span<PixelUse> uses = tiles[i].uses.uses;
        size_t first = 0;
        for (const TileSums::Pixel& pixel : tiles[i].pixels) {
            const auto ofPixel = uses.subspan(first, pixel.uses);
            std::sort(ofPixel.begin(), ofPixel.end(), [](const PixelUse& a, const PixelUse& b) {
                return std::tuple(a.half, a.cell) < std::tuple(b.half, b.cell);
            });
            first += pixel.uses;
        }
    });
    for (const TileSums& tile : tiles)
        linkUses(tile);
    joinRareAndEmission(tiles);
    clearPixelsWithout(tiles);
}

/// Clears the sums of pixels that no tile has: their tiles were not finished.
void RecordedLight::clearPixelsWithout(std::span<const TileSums> tiles) {
    std::vector<bool> hasTile(m_uses.size());
    for (const TileSums& tile : tiles)
        for (const TileSums::Pixel& pixel : tile.pixels)
            hasTile[pixel.index] = true;
    for (size_t i = 0; i < hasTile.size(); ++i)
        if (!hasTile[i])
            for (int half = 0; half < kHalves; ++half)
                pixels[kHalves * i + size_t(half)] = {};
}

/// Sets the uses of the pixels of a tile, and keeps their memory.
void RecordedLight::linkUses(const TileSums& tile) {
    size_t first = 0;
    for (const TileSums::Pixel& pixel : tile.pixels) {
        m_uses[pixel.index] = tile.uses.uses.subspan(first, pixel.uses);
        first += pixel.uses;
    }
    m_memory.push_back(tile.uses.memory);
}

void RecordedLight::joinRareAndEmission(std::span<const TileSums> tiles) {
    std::vector<EmissionSum> all;
    for (const TileSums& tile : tiles) {
        rare.insert(rare.end(), tile.rare.begin(), tile.rare.end());
        all.insert(all.end(), tile.emission.begin(), tile.emission.end());
    }
    std::sort(rare.begin(), rare.end(),
              [](const PixelRareSample& a, const PixelRareSample& b) { return keyOf(a) < keyOf(b); });
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.pixel < b.pixel; });
    for (const EmissionSum& one : all)
        if (!emission.empty() && emission.back().pixel == one.pixel)
            emission.back().sum.add(one.sum);
        else
            emission.push_back(one);
}

/// Sets `cells` to the sums of the cells of all tiles. Returns their indices by the index of each tile's.
std::vector<std::vector<uint32_t>> RecordedLight::joinCells(size_t tiles, size_t total,
                                                            const ForCells& forCells) {
    IndexTable indices(total);
    std::vector<std::vector<uint32_t>> numbers(tiles);
    cells.reserve(total);
    for (size_t i = 0; i < tiles; ++i)
        forCells(i, [&](const CellSums& cell) {
            const uint32_t index = indices.findOrInsert(cell.id.hash(), uint32_t(cells.size()));
            if (index == cells.size())
                cells.push_back(cell);
            else
                cells[index].add(cell);
            numbers[i].push_back(index);
        });
    struct Key { // small, so that sorting moves little memory
        CellId id;
        uint32_t index;
    };
    std::vector<Key> order;
    order.reserve(cells.size());
    for (uint32_t i = 0; i < cells.size(); ++i)
        order.push_back({cells[i].id, i});
    std::sort(order.begin(), order.end(), [](const Key& a, const Key& b) { return a.id < b.id; });
    std::vector<uint32_t> rank(cells.size());
    for (uint32_t i = 0; i < cells.size(); ++i)
        rank[order[i].index] = i;
    permute(cells, [&](uint32_t i) -> uint32_t& { return order[i].index; });
    for (std::vector<uint32_t>& ofTile : numbers)
        for (uint32_t& number : ofTile)
            number = rank[number];
    return numbers;
}

} // namespace strobe
