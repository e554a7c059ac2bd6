// The functions of RecordedLight that join tiles.
#include "core/util/parallel.h"
#include "sharing/records/joined_cells.h"
#include "sharing/records/recorded_light.h"

#include <algorithm>
#include <tuple>

namespace strobe {

namespace {

HalfPart partOf(const HalfLight& half, LightPart part) {
    RgbSum sum = half.quarters[0].light[int(part)];
    const Rgb quarter = sum.value();
    sum.add(half.quarters[1].light[int(part)]);
    return {sum.value(), quarter};
}

PixelEmission::Half emissionOfHalf(const HalfLight& half) {
    return {half.emitted.value(), float(half.ee.value()), float(half.ve.value())};
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
    m_weights.resize(kHalves * count);
    m_radiance.resize(kHalves * count);
    for (const LightPart part : kAllParts)
        if (parts.has(part))
            m_light[int(part)].resize(kHalves * count);
    m_uses.resize(count);
}

void PixelLists::clear() {
    counts.clear();
    uses.clear();
    rare.clear();
    emission.clear();
    refined.clear();
}

void RecordedLight::setPixel(size_t index, PixelLight& light, PixelLists& lists) {
    for (int half = 0; half < kHalves; ++half) {
        const HalfLight& from = light.halves[half];
        m_weights[kHalves * index + size_t(half)] = {from.weight(), from.quarters[0].weight()};
        m_radiance[kHalves * index + size_t(half)] = float(from.v.value());
        for (const LightPart part : kAllParts)
            if (parts.has(part))
                this->light(part, index, half) = partOf(from, part);
    }
    if (light.halves[0].hasEmission() || light.halves[1].hasEmission())
        lists.emission.push_back(
            {uint32_t(index), {emissionOfHalf(light.halves[0]), emissionOfHalf(light.halves[1])}});
    addUses(index, light, lists);
}

/// Adds the uses and the rare samples of a pixel, with one use per cell and half.
void RecordedLight::addUses(size_t index, PixelLight& light, PixelLists& lists) const {
    const size_t first = lists.uses.size();
    for (int half = 0; half < kHalves; ++half) {
        HalfLight& from = light.halves[half];
        sortUses(from.uses);
        for (const CellUse& use : from.uses)
            lists.uses.push_back({use.cell & 0x7fffffffu, uint32_t(half) & 1, use.albedoSum()});
        for (const RareSample& sample : from.rare)
            lists.rare.push_back({sample, uint32_t(index), uint32_t(half)});
    }
    lists.counts.push_back({uint32_t(index), uint32_t(lists.uses.size() - first)});
}

void RecordedLight::join(std::vector<TileSums> tiles) {
    std::vector<std::span<const CellSums>> cellsOfTiles;
    for (const TileSums& tile : tiles)
        cellsOfTiles.push_back(tile.cells.items);
    JoinedCells joined = joinCells(cellsOfTiles);
    cells = std::move(joined.cells);
    parallelFor(tiles.size(), [&](size_t i) {
        TileSums& tile = tiles[i];
        tile.cells = {};
        const std::vector<uint32_t>& numbers = joined.numbers[i];
        const std::span<PixelUse> uses = tile.uses.items;
        for (PixelUse& use : uses)
            use.cell = numbers[use.cell] & 0x7fffffffu;
        for (PixelRareSample& sample : tile.rare)
            sample.cell = numbers[sample.cell];
        size_t first = 0;
        for (const UseCount& of : tile.counts.items) {
            const auto ofPixel = uses.subspan(first, of.count);
            std::sort(ofPixel.begin(), ofPixel.end(), [](const PixelUse& a, const PixelUse& b) {
                return std::tuple(a.half, a.cell) < std::tuple(b.half, b.cell);
            });
            first += of.count;
        }
    });
    linkUses(tiles);
    joinLists(tiles);
    clearPixelsWithout(tiles);
}

/// Clears the pixels that no tile has: their tiles were not finished.
void RecordedLight::clearPixelsWithout(std::span<const TileSums> tiles) {
    std::vector<bool> hasTile(m_uses.size());
    for (const TileSums& tile : tiles)
        for (const UseCount& of : tile.counts.items)
            hasTile[of.pixel] = true;
    for (size_t i = 0; i < hasTile.size(); ++i)
        if (!hasTile[i]) {
            m_uses[i] = {};
            for (size_t half = kHalves * i; half < kHalves * (i + 1); ++half) {
                m_weights[half] = {};
                m_radiance[half] = 0;
                for (auto& ofPart : m_light)
                    if (!ofPart.empty())
                        ofPart[half] = {};
            }
        }
}

/// Sets the uses of the pixels of tiles, and keeps their memory.
void RecordedLight::linkUses(std::span<const TileSums> tiles) {
    parallelFor(tiles.size(), [&](size_t i) {
        size_t first = 0;
        for (const UseCount& of : tiles[i].counts.items) {
            m_uses[of.pixel] = tiles[i].uses.items.subspan(first, of.count);
            first += of.count;
        }
    });
    for (const TileSums& tile : tiles)
        m_useMemory.push_back(tile.uses.memory);
}

/// Joins the lists of all tiles.
void RecordedLight::joinLists(std::span<const TileSums> tiles) {
    std::vector<EmissionSum> all;
    for (const TileSums& tile : tiles) {
        rare.insert(rare.end(), tile.rare.begin(), tile.rare.end());
        emission.insert(emission.end(), tile.emission.begin(), tile.emission.end());
        all.insert(all.end(), tile.refined.begin(), tile.refined.end());
    }
    std::sort(rare.begin(), rare.end(),
              [](const PixelRareSample& a, const PixelRareSample& b) { return keyOf(a) < keyOf(b); });
    const auto byPixel = [](const auto& a, const auto& b) { return a.pixel < b.pixel; };
    std::sort(emission.begin(), emission.end(), byPixel);
    std::sort(all.begin(), all.end(), byPixel);
    for (const EmissionSum& one : all)
        if (!refined.empty() && refined.back().pixel == one.pixel)
            refined.back().sum.add(one.sum);
        else
            refined.push_back(one);
}

std::span<const PixelEmission> RecordedLight::emissionOf(size_t first, size_t end) const {
    const auto precedes = [](const PixelEmission& item, size_t pixel) { return item.pixel < pixel; };
    const auto begin = std::lower_bound(emission.begin(), emission.end(), first, precedes);
    return {begin, std::lower_bound(begin, emission.end(), end, precedes)};
}

} // namespace strobe
