#include "sharing/tile_light.h"

#include "core/util/error.h"

#include <algorithm>
#include <bit>

namespace strobe {

namespace {

/// Changes with the meaning of the integers of records.
constexpr int64_t kFormat = 2;
constexpr uint32_t kMaxSamples = PixelAccumulator::kMaxSamples;
/// The integers of a cell without its light, of a cell, of a half of a pixel without its uses and rare
/// samples, of a use and of a rare sample.
constexpr size_t kDarkCellIntegers = 6 + 6 + kHalves,
                 kCellIntegers = kDarkCellIntegers + kHalves * 3 * kParts;
constexpr size_t kHalfIntegers = kQuarters * (1 + 3 * kParts) + 3 + 4 + 2;
constexpr size_t kUseIntegers = 1 + 3;
constexpr size_t kRareIntegers = 3 + 6;
/// The rows of pixels are preceded by a table of the ends of rows.
using RowEnd = uint64_t;

size_t pixelCount(const PixelBounds& bounds) { return size_t(bounds.width()) * size_t(bounds.height()); }

void write(IntegerWriter& out, const RgbSum& sum) {
    for (const FixedPointSum& channel : sum.channels)
        out.add(channel.units());
}
void write(IntegerWriter& out, const CellSums& cell, LightParts parts) {
    const CellId& id = cell.id;
    out.add(int64_t(id.surface));
    for (const int64_t value : {id.x, id.y, id.z, int32_t(id.level), int32_t(id.face)})
        out.add(value);
    for (const uint32_t count : cell.count)
        out.add(count);
    for (int k = 0; k < 3; ++k) {
        out.add(cell.p[k]);
        out.add(cell.n[k]);
    }
    for (int part = 0; part < kParts; ++part)
        if (parts.has(LightPart(part)))
            for (const RgbSum& light : cell.light[part])
                write(out, light);
}
bool hasEmission(const HalfLight& half) {
    return !(half.emitted == RgbSum() && half.ee == FixedPointSum() && half.ve == FixedPointSum());
}

/// Writes the bits of the channels.
void write(IntegerWriter& out, const Rgb& color) {
    for (int c = 0; c < 3; ++c)
        out.add(std::bit_cast<int32_t>(color[c]));
}
void write(IntegerWriter& out, const RareSample& sample) {
    out.add(sample.cell);
    out.add(sample.part);
    out.add(sample.isInQuarter);
    write(out, sample.light);
    write(out, sample.albedo);
}

Rgb readColor(IntegerReader& in) {
    Rgb color;
    for (int c = 0; c < 3; ++c)
        color[c] = std::bit_cast<float>(int32_t(in.next(INT32_MIN, INT32_MAX)));
    return color;
}
void addNext(IntegerReader& in, RgbSum& sum) {
    for (FixedPointSum& channel : sum.channels)
        channel.add(FixedPointSum(in.next()));
}
/// Reads the sums of a cell in a tile of this many pixels.
CellSums readCell(IntegerReader& in, size_t pixels, LightParts parts) {
    CellSums cell;
    CellId& id = cell.id;
    constexpr int64_t kMax = CellId::kMaxIndex;
    id.surface = uint64_t(in.next(INT64_MIN, INT64_MAX));
    id.x = int32_t(in.next(-kMax, kMax));
    id.y = int32_t(in.next(-kMax, kMax));
    id.z = int32_t(in.next(-kMax, kMax));
    id.level = int16_t(in.next(-CellId::kMaxLevel, CellId::kMaxLevel));
    id.face = uint16_t(in.next(0, CellId::kFaces - 1));
    const auto maxCount = int64_t(std::min<uint64_t>(uint64_t(pixels) * kMaxSamples, UINT32_MAX));
    for (uint32_t& count : cell.count)
        count = uint32_t(in.next(0, maxCount));
    const int64_t total = int64_t(cell.count[0]) + int64_t(cell.count[1]);
    for (int k = 0; k < 3; ++k) {
        cell.p[k] = in.next(0, total << CellSums::kPositionBits);
        cell.n[k] = in.next(-total << CellSums::kNormalBits, total << CellSums::kNormalBits);
    }
    for (int part = 0; part < kParts; ++part)
        if (parts.has(LightPart(part)))
            for (RgbSum& light : cell.light[part])
                addNext(in, light);
    return cell;
}

} // namespace

void HalfLight::clear() {
    std::vector<CellUse> emptiedUses = std::move(uses);
    std::vector<RareSample> emptiedRare = std::move(rare);
    emptiedUses.clear();
    emptiedRare.clear();
    *this = {};
    uses = std::move(emptiedUses);
    rare = std::move(emptiedRare);
}

void HalfLight::mergeUses() {
    std::sort(uses.begin(), uses.end(), [](const CellUse& a, const CellUse& b) { return a.cell < b.cell; });
    size_t count = 0;
    for (const CellUse& use : uses)
        if (count > 0 && uses[count - 1].cell == use.cell)
            uses[count - 1].add(use);
        else
            uses[count++] = use;
    uses.resize(count);
}

void TileLight::clear() {
    m_cells.clear();
    m_cellIndices.clear();
    m_lastCell = 0;
    m_pixels.clear();
    m_pixelBytes.clear();
    m_emission.clear();
}

uint32_t TileLight::findOtherCell(const CellId& id) {
    m_lastCell = m_cellIndices.findOrInsert(id.hash(), uint32_t(m_cells.size()));
    if (m_lastCell == m_cells.size())
        m_cells.emplace_back().id = id;
    return m_lastCell;
}

void TileLight::addPixel(int x, int y, const PixelLight& light) {
    const size_t first = m_pixelBytes.size();
    for (const HalfLight& half : light.halves)
        writeHalf(half);
    m_pixels.push_back({x, y, first, m_pixelBytes.size() - first});
}

void TileLight::writeHalf(const HalfLight& half) {
    IntegerWriter& out = m_pixelBytes;
    out.reserve(kHalfIntegers + half.uses.size() * kUseIntegers + half.rare.size() * kRareIntegers);
    for (const HalfLight::Quarter& quarter : half.quarters)
        out.add(quarter.count);
    if (half.count() == 0)
        return;
    for (const HalfLight::Quarter& quarter : half.quarters)
        for (int part = 0; part < kParts; ++part)
            if (m_parts.has(LightPart(part)))
                write(out, quarter.light[part]);
    out.add(half.v.units());
    out.add(hasEmission(half));
    if (hasEmission(half)) {
        write(out, half.emitted);
        for (const FixedPointSum& moment : {half.ee, half.ve})
            out.add(moment.units());
    }
    out.add(__int128(half.uses.size()));
    for (const CellUse& use : half.uses) {
        out.add(use.cell);
        for (const int64_t albedo : use.albedo)
            out.add(albedo);
    }
    out.add(__int128(half.rare.size()));
    for (const RareSample& sample : half.rare)
        write(out, sample);
}

void TileLight::writeHeader(const PixelBounds& tile) {
    m_header.clear();
    m_header.reserve(4 + m_cells.size() * kCellIntegers + m_emission.size());
    m_header.add(kFormat);
    m_header.add(m_parts.bits());
    m_header.add(__int128(m_cells.size()));
    for (const CellSums& cell : m_cells)
        write(m_header, cell, m_parts);
    m_header.add(__int128(m_emission.size()));
    for (const EmissionEntry& entry : m_emission)
        m_header.add(int64_t(entry.y - tile.y0) * tile.width() + (entry.x - tile.x0));
}

/// Appends the ends of the rows, in bytes from the start of the first row, and the rows.
void TileLight::writeRows(const PixelBounds& tile, std::string& out) {
    static const std::string_view kNoSamples("\0\0\0\0", kHalves * kQuarters); // counts
    constexpr size_t kAbsent = ~size_t(0);
    std::vector<size_t> entryOf(pixelCount(tile), kAbsent);
    for (size_t i = 0; i < m_pixels.size(); ++i)
        entryOf[size_t(m_pixels[i].y - tile.y0) * size_t(tile.width()) + size_t(m_pixels[i].x - tile.x0)] = i;
    const size_t tableStart = out.size(), start = tableStart + size_t(tile.height()) * sizeof(RowEnd);
    out.reserve(start + m_pixelBytes.size() + kNoSamples.size() * (entryOf.size() - m_pixels.size()));
    out.resize(start);
    for (int y = 0; y < tile.height(); ++y) {
        for (int x = 0; x < tile.width(); ++x) {
            const size_t entry = entryOf[size_t(y) * size_t(tile.width()) + size_t(x)];
            out += entry == kAbsent
                       ? kNoSamples
                       : m_pixelBytes.bytes().substr(m_pixels[entry].first, m_pixels[entry].size);
        }
        const RowEnd end = out.size() - start;
        std::memcpy(&out[tableStart + size_t(y) * sizeof end], &end, sizeof end);
    }
}

FilmRecord TileLight::record(const PixelBounds& tile, const SampleSlice& samples) {
    writeHeader(tile);
    std::string bytes(m_header.bytes());
    for (const EmissionEntry& entry : m_emission) {
        bytes.resize(bytes.size() + PixelAccumulator::kBytes);
        entry.sum.store(&bytes[bytes.size() - PixelAccumulator::kBytes]);
    }
    writeRows(tile, bytes);
    return {tile, samples, std::make_shared<const std::string>(std::move(bytes))};
}

void TileLightReader::fail() { throw Error("the record of a tile is damaged", ErrorKind::Usage); }

TileLightReader::TileLightReader(FilmRecord record) : m_record(std::move(record)) {
    IntegerReader header(*m_record.bytes);
    if (header.next() != kFormat)
        fail();
    m_parts = LightParts(uint32_t(header.next(0, (1 << kParts) - 1)));
    readCells(header);
    readEmission(header);
    m_rowTable = header.position() + m_emission.size() * PixelAccumulator::kBytes;
    m_rowsStart = m_rowTable + size_t(m_record.pixels.height()) * sizeof(RowEnd);
    if (m_rowsStart > m_record.bytes->size())
        fail();
}

void TileLightReader::readCells(IntegerReader& header) {
    const size_t pixels = pixelCount(m_record.pixels);
    // An integer takes a byte at least.
    const auto count = size_t(header.next(0, int64_t(header.left() / kDarkCellIntegers)));
    m_cells.reserve(count);
    m_cellNumbers.resize(count);
    for (size_t i = 0; i < count && !header.hasFailed(); ++i) {
        m_cells.push_back(readCell(header, pixels, m_parts));
        if (m_cells.back().count[0] + m_cells.back().count[1] == 0)
            fail();
        m_cellNumbers[i] = uint32_t(i);
    }
    if (header.hasFailed())
        fail();
}

void TileLightReader::readEmission(IntegerReader& header) {
    const int64_t pixels = int64_t(pixelCount(m_record.pixels));
    const auto count = size_t(header.next(0, int64_t(header.left() / (1 + PixelAccumulator::kBytes))));
    m_emission.resize(count);
    for (EmissionSum& emission : m_emission)
        emission.pixel = size_t(header.next(0, pixels - 1));
    if (header.hasFailed() || header.left() < count * PixelAccumulator::kBytes)
        fail();
    for (size_t i = 0; i < count; ++i)
        m_emission[i].sum.load(m_record.bytes->data() + header.position() + i * PixelAccumulator::kBytes);
}

TileLightReader::Row TileLightReader::row(int y) const {
    const std::string& bytes = *m_record.bytes;
    RowEnd first = 0, end = 0;
    const char* table = bytes.data() + m_rowTable;
    const auto index = size_t(y - m_record.pixels.y0);
    if (index > 0)
        std::memcpy(&first, table + (index - 1) * sizeof first, sizeof first);
    std::memcpy(&end, table + index * sizeof end, sizeof end);
    if (first > end || end > bytes.size() - m_rowsStart)
        fail();
    return {*this, std::string_view(bytes).substr(m_rowsStart + first, end - first)};
}

void TileLightReader::Row::addNext(PixelLight& light) {
    for (HalfLight& half : light.halves)
        addHalf(half);
    if (m_reader.hasFailed())
        fail();
}

void TileLightReader::Row::addHalf(HalfLight& half) {
    bool hasSamples = false;
    for (HalfLight::Quarter& quarter : half.quarters) {
        const auto count = uint32_t(m_reader.next(0, kMaxSamples));
        quarter.count += count;
        hasSamples |= count > 0;
    }
    if (!hasSamples)
        return;
    for (HalfLight::Quarter& quarter : half.quarters)
        for (int part = 0; part < kParts; ++part)
            if (m_tile->m_parts.has(LightPart(part)))
                strobe::addNext(m_reader, quarter.light[part]);
    half.v.add(FixedPointSum(m_reader.next()));
    if (m_reader.next(0, 1) == 1) {
        strobe::addNext(m_reader, half.emitted);
        for (FixedPointSum* moment : {&half.ee, &half.ve})
            moment->add(FixedPointSum(m_reader.next()));
    }
    const auto uses = size_t(m_reader.next(0, int64_t(m_reader.left() / kUseIntegers)));
    const auto cells = int64_t(m_tile->m_cellNumbers.size());
    for (size_t i = 0; i < uses && !m_reader.hasFailed(); ++i) {
        const int64_t cell = m_reader.next(0, cells - 1);
        CellUse use;
        for (int64_t& albedo : use.albedo)
            albedo = m_reader.next(INT64_MIN, INT64_MAX);
        if (m_reader.hasFailed())
            return;
        use.cell = m_tile->m_cellNumbers[size_t(cell)];
        half.uses.push_back(use);
    }
    addRare(half);
}

void TileLightReader::Row::addRare(HalfLight& half) {
    const auto count = size_t(m_reader.next(0, int64_t(m_reader.left() / kRareIntegers)));
    const auto cells = int64_t(m_tile->m_cellNumbers.size());
    for (size_t i = 0; i < count && !m_reader.hasFailed(); ++i) {
        RareSample sample;
        const int64_t cell = m_reader.next(0, cells - 1);
        sample.part = uint8_t(m_reader.next(0, kParts - 1));
        sample.isInQuarter = m_reader.next(0, 1) == 1;
        sample.light = readColor(m_reader);
        sample.albedo = readColor(m_reader);
        if (m_reader.hasFailed())
            return;
        if (!isFinite(sample.light) || !isFinite(sample.albedo))
            fail();
        sample.cell = m_tile->m_cellNumbers[size_t(cell)];
        half.rare.push_back(sample);
    }
}

} // namespace strobe
