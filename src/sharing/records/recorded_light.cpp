#include "sharing/records/recorded_light.h"

#include "core/util/error.h"
#include "core/util/parallel.h"
#include "sharing/records/joined_cells.h"

#include <algorithm>
#include <optional>

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

float toFloat(int64_t units) { return float(double(units) * (1 / FixedPointSum::kPerUnit)); }

float sumToFloat(int64_t a, int64_t b) {
    int64_t sum;
    return __builtin_add_overflow(a, b, &sum) ? float(FixedPointSum(__int128(a) + b).value()) : toFloat(sum);
}

/// Returns the light of a half of a pixel of a record, whose sums of the part begin at `first`. `stride`: the
/// number of sums of a quarter.
HalfPart partOf(const HalfBytes& half, size_t first, size_t stride) {
    HalfPart out;
    for (int c = 0; c < 3; ++c) {
        const size_t index = first + size_t(c);
        if (half.isLong) {
            FixedPointSum sum = half.sum(index);
            out.quarterLight[c] = float(sum.value());
            sum.add(half.sum(index + stride));
            out.light[c] = float(sum.value());
        } else {
            const auto a = numberAt<int64_t>(half.sums + index * sizeof(int64_t));
            const auto b = numberAt<int64_t>(half.sums + (index + stride) * sizeof(int64_t));
            out.quarterLight[c] = toFloat(a);
            out.light[c] = sumToFloat(a, b);
        }
    }
    return out;
}

PixelEmission::Half emissionOfHalf(const HalfBytes& half) {
    PixelEmission::Half out;
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

/// Returns the parts of the light of tiles.
LightParts partsOf(const std::vector<TileLightReader>& tiles) {
    return tiles.empty() ? LightParts() : tiles.front().parts();
}

/// Returns the additional samples of emission of all tiles.
std::vector<EmissionSum> refinedOf(const std::vector<TileLightReader>& tiles, const PixelBounds& bounds) {
    std::vector<EmissionSum> all;
    for (const TileLightReader& tile : tiles)
        for (const EmissionSum& one : tile.emission()) {
            const auto width = size_t(tile.pixels().width());
            const size_t x = one.pixel % width + size_t(tile.pixels().x0 - bounds.x0);
            const size_t y = one.pixel / width + size_t(tile.pixels().y0 - bounds.y0);
            all.push_back({y * size_t(bounds.width()) + x, one.sum});
        }
    return all;
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

RecordedLight::RecordedLight(const Film& film)
    : RecordedLight(film.pixelBounds(), readersOf(film.records().all())) {}

RecordedLight::RecordedLight(const PixelBounds& bounds, std::vector<TileLightReader> tiles)
    : RecordedLight(bounds, partsOf(tiles)) {
    const auto height = size_t(pixelBounds.height());
    std::vector<std::vector<const TileLightReader*>> tilesOfRow(height);
    for (const TileLightReader& tile : tiles) {
        requireSameParts(tile, tiles.front());
        if (!isInside(tile.pixels(), pixelBounds))
            throw Error("the record of a tile has pixels outside of the image", ErrorKind::Usage);
        for (int y = tile.pixels().y0; y < tile.pixels().y1; ++y)
            tilesOfRow[size_t(y - pixelBounds.y0)].push_back(&tile);
    }
    joinCellsOf(tiles);
    std::vector<TileSums> rows(height);
    ByteArena counts, uses; // the counts are freed first
    parallelFor(height, [&](size_t row) {
        std::sort(tilesOfRow[row].begin(), tilesOfRow[row].end(),
                  [](const auto* a, const auto* b) { return a->pixels().x0 < b->pixels().x0; });
        PixelLists lists;
        joinRow(pixelBounds.y0 + int(row), tilesOfRow[row], lists);
        rows[row] = {{},
                     counts.copy(lists.counts),
                     uses.copy(lists.uses),
                     std::move(lists.rare),
                     std::move(lists.emission),
                     {}};
    });
    if (!rows.empty())
        rows.front().refined = refinedOf(tiles, pixelBounds);
    linkUses(rows);
    joinLists(rows);
}

/// Sets `cells` to the sums of the cells of all tiles, and the numbers of the cells in the tiles.
void RecordedLight::joinCellsOf(std::vector<TileLightReader>& tiles) {
    std::vector<SharedItems<CellSums>> read(tiles.size());
    ByteArena arena;
    parallelFor(tiles.size(), [&](size_t i) {
        std::vector<CellSums> ofTile;
        ofTile.reserve(tiles[i].cellCount());
        tiles[i].forCells([&](const CellSums& cell) { ofTile.push_back(cell); });
        read[i] = arena.copy(ofTile);
    });
    std::vector<std::span<const CellSums>> cellsOfTiles;
    for (const SharedItems<CellSums>& ofTile : read)
        cellsOfTiles.push_back(ofTile.items);
    JoinedCells joined = joinCells(cellsOfTiles);
    for (size_t i = 0; i < tiles.size(); ++i)
        tiles[i].setCellNumbers(std::move(joined.numbers[i]));
    cells = std::move(joined.cells);
}

/// Adds up the pixels of a row. `tiles`: those that contain pixels of the row, by ascending first pixels.
void RecordedLight::joinRow(int y, const std::vector<const TileLightReader*>& tiles, PixelLists& lists) {
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
        if (rows.size() != 1) {
            light.clear();
            addNext(rows, light);
            setPixel(index, light, lists);
            continue;
        }
        PixelEmission ofPixel{uint32_t(index), {}};
        bool emits = false;
        for (int half = 0; half < kHalves; ++half) { // without the sums of all records
            const HalfBytes bytes = rows[0].nextHalf();
            light.halves[half].uses.clear();
            light.halves[half].rare.clear();
            setHalf(index, half, bytes);
            ofPixel.halves[half] = emissionOfHalf(bytes);
            emits |= bytes.emission != nullptr;
            rows[0].tile().addUses(bytes, light.halves[half].uses);
            rows[0].tile().addRare(bytes, light.halves[half].rare);
        }
        if (emits)
            lists.emission.push_back(ofPixel);
        addUses(index, light, lists);
    }
}

/// Sets the weights and the light of a half of a pixel of a record.
void RecordedLight::setHalf(size_t pixel, int half, const HalfBytes& from) {
    m_weights[kHalves * pixel + size_t(half)] = {from.weight(0) + from.weight(1), from.weight(0)};
    m_radiance[kHalves * pixel + size_t(half)] = from.sums ? float(from.sum(0).value()) : 0;
    const size_t stride = parts == LightParts::all() ? 3 * kParts : 3;
    size_t first = 1;
    for (const LightPart part : kAllParts)
        if (parts.has(part)) {
            light(part, pixel, half) = from.sums ? partOf(from, first, stride) : HalfPart();
            first += 3;
        }
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
