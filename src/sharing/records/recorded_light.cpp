#include "sharing/records/recorded_light.h"

#include "core/util/error.h"
#include "core/util/parallel.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>

namespace strobe {

namespace {

/// Reads the headers of all records.
std::vector<TileLightReader> readersOf(const std::vector<FilmRecord>& records) {
    std::vector<std::optional<TileLightReader>> read(records.size());
    parallelFor(records.size(), [&](size_t i) { read[i].emplace(records[i]); });
    std::vector<TileLightReader> readers;
    readers.reserve(read.size());
    for (auto& reader : read)
        readers.push_back(std::move(*reader));
    return readers;
}

bool isInside(const PixelBounds& inner, const PixelBounds& outer) {
    return inner.x0 >= outer.x0 && inner.y0 >= outer.y0 && inner.x1 <= outer.x1 && inner.y1 <= outer.y1;
}

bool areEqual(const PixelBounds& a, const PixelBounds& b) {
    return a.x0 == b.x0 && a.y0 == b.y0 && a.x1 == b.x1 && a.y1 == b.y1;
}

/// Sorts samples by all that they hold.
void sort(std::vector<RareSample>& samples) {
    const auto key = [](const RareSample& s) {
        return std::tuple(s.cell, s.part, s.isInQuarter, s.light.x, s.light.y, s.light.z, s.albedo.x,
                          s.albedo.y, s.albedo.z);
    };
    std::sort(samples.begin(), samples.end(),
              [&](const RareSample& a, const RareSample& b) { return key(a) < key(b); });
}

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

float toFloat(int64_t units) { return float(double(units) * (1 / FixedPointSum::kPerUnit)); }

float sumToFloat(int64_t a, int64_t b) {
    int64_t sum;
    return __builtin_add_overflow(a, b, &sum) ? float(FixedPointSum(__int128(a) + b).value()) : toFloat(sum);
}

/// Writes the light of a half of a pixel of a record with these parts.
void setLight(const HalfBytes& half, LightParts parts, HalfPixelSums& out) {
    const size_t lights = parts == LightParts::all() ? 3 * kParts : 3; // of a quarter
    size_t next = 1;
    for (int part = 0; part < kParts; ++part) {
        if (!parts.has(LightPart(part)))
            continue;
        for (size_t c = 0; c < 3; ++c) {
            if (half.isLong) {
                FixedPointSum sum = half.sum(next + c);
                out.quarterLight[part][int(c)] = float(sum.value());
                sum.add(half.sum(next + c + lights));
                out.light[part][int(c)] = float(sum.value());
            } else {
                const auto first = numberAt<int64_t>(half.sums + (next + c) * sizeof(int64_t));
                const auto second = numberAt<int64_t>(half.sums + (next + c + lights) * sizeof(int64_t));
                out.quarterLight[part][int(c)] = toFloat(first);
                out.light[part][int(c)] = sumToFloat(first, second);
            }
        }
        next += 3;
    }
}

/// Returns the sums of a half of a pixel of a record with these parts.
HalfPixelSums toFloats(const HalfBytes& half, LightParts parts) {
    HalfPixelSums out;
    if (!half.sums)
        return out;
    out.count = half.counts[0] + half.counts[1];
    out.quarterCount = half.counts[0];
    out.v = float(half.sum(0).value());
    setLight(half, parts, out);
    if (half.emission) {
        for (int c = 0; c < 3; ++c)
            out.emitted[c] = float(half.emissionSum(size_t(c)).value());
        out.ee = float(half.emissionSum(3).value());
        out.ve = float(half.emissionSum(4).value());
    }
    return out;
}

void requireSameParts(const TileLightReader& a, const TileLightReader& b) {
    if (a.parts() != b.parts())
        throw Error("the records of tiles have different parts of the light", ErrorKind::Usage);
}

/// Adds the next pixel of rows of different records.
void addNext(std::span<TileLightReader::Row> rows, PixelLight& light) {
    for (TileLightReader::Row& row : rows)
        for (HalfLight& half : light.halves)
            row.tile().add(row.nextHalf(), half);
}

/// Returns the record of the sum of records of the same pixels.
FilmRecord sumOf(std::span<const FilmRecord> records) {
    std::vector<TileLightReader> tiles(records.begin(), records.end());
    TileLight sum(tiles.front().parts());
    SampleSlice samples = records.front().samples;
    for (size_t i = 0; i < tiles.size(); ++i) {
        TileLightReader& tile = tiles[i];
        requireSameParts(tile, tiles.front());
        std::vector<uint32_t> numbers;
        tile.forCells([&](const CellSums& cell) {
            numbers.push_back(sum.findCell(cell.id));
            sum.cell(numbers.back()).add(cell);
        });
        tile.setCellNumbers(std::move(numbers));
        const SampleSlice& slice = records[i].samples;
        samples = {std::min(samples.first, slice.first), std::max(samples.end, slice.end)};
    }
    const PixelBounds& bounds = records.front().pixels;
    PixelLight light;
    for (int y = bounds.y0; y < bounds.y1; ++y) {
        std::vector<TileLightReader::Row> rows;
        for (const TileLightReader& tile : tiles)
            rows.push_back(tile.row(y));
        for (int x = bounds.x0; x < bounds.x1; ++x) {
            light.clear();
            addNext(rows, light);
            for (HalfLight& half : light.halves)
                sortUses(half.uses);
            sum.addPixel(x, y, light);
        }
    }
    for (const TileLightReader& tile : tiles)
        for (const EmissionSum& emission : tile.emission())
            sum.addEmission(bounds.x0 + int(emission.pixel % size_t(bounds.width())),
                            bounds.y0 + int(emission.pixel / size_t(bounds.width())), emission.sum);
    return sum.record(bounds, samples);
}

} // namespace

RecordedLight::RecordedLight(const Film& film) : pixelBounds(film.pixelBounds()) {
    const auto width = size_t(pixelBounds.width()), height = size_t(pixelBounds.height());
    pixels.resize(kHalves * width * height);
    m_endOfUses.resize(width * height);
    m_usesOfRow.resize(height);
    m_rareOfRow.resize(height);
    std::vector<TileLightReader> tiles = readersOf(film.records().all());
    std::vector<std::vector<const TileLightReader*>> tilesOfRow(height);
    for (const TileLightReader& tile : tiles) {
        requireSameParts(tile, tiles.front());
        if (!isInside(tile.pixels(), pixelBounds))
            throw Error("the record of a tile has pixels outside of the image", ErrorKind::Usage);
        for (int y = tile.pixels().y0; y < tile.pixels().y1; ++y)
            tilesOfRow[size_t(y - pixelBounds.y0)].push_back(&tile);
    }
    if (!tiles.empty())
        parts = tiles.front().parts();
    joinCells(tiles);
    ByteArena arena;
    std::mutex arenaMutex;
    parallelFor(height, [&](size_t row) {
        std::sort(tilesOfRow[row].begin(), tilesOfRow[row].end(),
                  [](const auto* a, const auto* b) { return a->pixels().x0 < b->pixels().x0; });
        std::vector<PixelUse> uses;
        joinRow(pixelBounds.y0 + int(row), tilesOfRow[row], uses);
        std::shared_ptr<char> memory;
        {
            const std::lock_guard lock(arenaMutex);
            memory = arena.allocate(uses.size() * sizeof(PixelUse));
        }
        auto* const first = reinterpret_cast<PixelUse*>(memory.get());
        std::uninitialized_copy(uses.begin(), uses.end(), first);
        m_usesOfRow[row] = {{first, uses.size()}, std::move(memory)};
    });
    for (const auto& row : m_rareOfRow)
        rare.insert(rare.end(), row.begin(), row.end());
    m_rareOfRow.clear();
    joinEmission(tiles);
}

/// Adds up the cells of all tiles, and numbers the cells of each tile by their indices in `cells`.
void RecordedLight::joinCells(std::vector<TileLightReader>& tiles) {
    std::vector<std::vector<uint32_t>> numbers;
    size_t total = 0; // those on several tiles count several times
    for (const TileLightReader& tile : tiles)
        total += tile.cellCount();
    IndexTable indices(total);
    cells.reserve(total);
    for (TileLightReader& tile : tiles) {
        std::vector<uint32_t>& numbersOfTile = numbers.emplace_back();
        tile.forCells([&](const CellSums& cell) {
            const uint32_t index = indices.findOrInsert(cell.id.hash(), uint32_t(cells.size()));
            if (index == cells.size())
                cells.push_back(cell);
            else
                cells[index].add(cell);
            numbersOfTile.push_back(index);
        });
    }
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
    for (size_t i = 0; i < tiles.size(); ++i) {
        for (uint32_t& number : numbers[i])
            number = rank[number];
        tiles[i].setCellNumbers(std::move(numbers[i]));
    }
}

/// Adds up the pixels of a row. `tiles`: those that contain pixels of the row, by ascending first pixels.
void RecordedLight::joinRow(int y, const std::vector<const TileLightReader*>& tiles,
                            std::vector<PixelUse>& uses) {
    std::vector<TileLightReader::Row> rows; // that contain the current pixel
    std::vector<int> ends;                  // of these
    size_t next = 0, index = size_t(y - pixelBounds.y0) * size_t(pixelBounds.width());
    PixelLight light;
    for (int x = pixelBounds.x0; x < pixelBounds.x1; ++x, ++index) {
        for (size_t i = ends.size(); i-- > 0;)
            if (ends[i] == x) {
                rows.erase(rows.begin() + std::ptrdiff_t(i));
                ends.erase(ends.begin() + std::ptrdiff_t(i));
            }
        for (; next < tiles.size() && tiles[next]->pixels().x0 == x; ++next) {
            rows.push_back(tiles[next]->row(y));
            ends.push_back(tiles[next]->pixels().x1);
        }
        for (HalfLight& half : light.halves) {
            half.uses.clear();
            half.rare.clear();
        }
        if (rows.size() == 1) { // without the sums of all records
            for (int half = 0; half < kHalves; ++half) {
                const HalfBytes bytes = rows[0].nextHalf();
                pixels[kHalves * index + size_t(half)] = toFloats(bytes, parts);
                rows[0].tile().addUses(bytes, light.halves[half].uses);
                rows[0].tile().addRare(bytes, light.halves[half].rare);
            }
        } else {
            light.clear();
            addNext(rows, light);
            for (int half = 0; half < kHalves; ++half)
                pixels[kHalves * index + size_t(half)] = toFloats(light.halves[half]);
        }
        setUses(index, light, uses);
    }
}

/// Sets the uses and the rare samples of a pixel, in this order, so that sums of floats do not depend on the
/// order of rendering.
void RecordedLight::setUses(size_t index, PixelLight& light, std::vector<PixelUse>& usesOfRow) {
    const size_t row = index / size_t(pixelBounds.width());
    for (int half = 0; half < kHalves; ++half) {
        HalfLight& from = light.halves[half];
        sortUses(from.uses);
        for (const CellUse& use : from.uses)
            usesOfRow.push_back({use.cell & 0x7fffffffu, uint32_t(half) & 1, use.albedoSum()});
        if (!from.rare.empty())
            sort(from.rare);
        for (const RareSample& sample : from.rare)
            m_rareOfRow[row].push_back({sample, uint32_t(index), uint32_t(half)});
    }
    m_endOfUses[index] = uint32_t(usesOfRow.size());
}

void RecordedLight::joinEmission(const std::vector<TileLightReader>& tiles) {
    std::vector<EmissionSum> all;
    for (const TileLightReader& tile : tiles)
        for (const EmissionSum& one : tile.emission()) {
            const auto width = size_t(tile.pixels().width());
            const size_t x = one.pixel % width + size_t(tile.pixels().x0 - pixelBounds.x0);
            const size_t y = one.pixel / width + size_t(tile.pixels().y0 - pixelBounds.y0);
            all.push_back({y * size_t(pixelBounds.width()) + x, one.sum});
        }
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.pixel < b.pixel; });
    for (const EmissionSum& one : all)
        if (!emission.empty() && emission.back().pixel == one.pixel)
            emission.back().sum.add(one.sum);
        else
            emission.push_back(one);
}

void mergeRecordsOfSamePixels(FilmRecords& records) {
    const std::vector<FilmRecord> all = records.all();
    std::vector<std::vector<FilmRecord>> groups; // of the same pixels
    size_t firstOfCorner = 0;
    for (const FilmRecord& record : all) {
        const auto corner = [](const PixelBounds& b) { return std::pair(b.x0, b.y0); };
        if (!groups.empty() && corner(groups.back().front().pixels) != corner(record.pixels))
            firstOfCorner = groups.size();
        const auto same =
            std::find_if(groups.begin() + std::ptrdiff_t(firstOfCorner), groups.end(),
                         [&](const auto& group) { return areEqual(group.front().pixels, record.pixels); });
        if (same == groups.end())
            groups.push_back({record});
        else
            same->push_back(record);
    }
    if (groups.size() == all.size())
        return;
    std::vector<FilmRecord> merged(groups.size());
    parallelFor(groups.size(),
                [&](size_t i) { merged[i] = groups[i].size() == 1 ? groups[i].front() : sumOf(groups[i]); });
    records.set(std::move(merged));
}

} // namespace strobe
