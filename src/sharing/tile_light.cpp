#include "sharing/tile_light.h"

#include "core/util/error.h"

#include <algorithm>
#include <bit>

namespace strobe {

namespace {

/// Changes with the meaning of the integers of records.
constexpr int64_t kFormat = 3;
constexpr uint32_t kMaxSamples = PixelAccumulator::kMaxSamples;
constexpr size_t kLights = 3 * kParts; ///< of a quarter of a pixel, or of a half of a cell
/// The maximum number of integers, with the lengths of groups, of a cell, of a half of a pixel without its
/// uses and rare samples, of a use and of a rare sample.
constexpr size_t kCellIntegers = 1 + 4 + 5 + 7 + 1 + kHalves * kLights;
constexpr size_t kHalfIntegers = 6 + 1 + kQuarters * kLights + 1 + 5 + 2;
constexpr size_t kUseIntegers = 1 + 3;
constexpr size_t kRareIntegers = 3 + 6;
/// The minimum numbers of bytes of a cell and of a rare sample.
constexpr size_t kMinCellBytes = 5, kMinRareBytes = kRareIntegers;
/// The rows of pixels are preceded by a table of the ends of rows.
using RowEnd = uint64_t;

size_t pixelCount(const PixelBounds& bounds) { return size_t(bounds.width()) * size_t(bounds.height()); }

/// The units of sums of light, to be written or read as a group.
struct SumGroup {
    __int128 units[1 + kHalves * kLights];
    size_t count = 0;
    void push(const FixedPointSum& sum) { units[count++] = sum.units(); }
    void push(const RgbSum& sum) {
        for (const FixedPointSum& channel : sum.channels)
            push(channel);
    }
    void write(IntegerWriter& out) const { out.addLongGroup(units, count); }
    /// Reads `number` sums. `pop` adds the next of them.
    void read(IntegerReader& in, size_t number) {
        in.nextLongGroup(units, number);
        count = 0;
    }
    void pop(FixedPointSum& sum) { sum.add(FixedPointSum(units[count++])); }
    void pop(RgbSum& sum) {
        for (FixedPointSum& channel : sum.channels)
            pop(channel);
    }
};
static_assert(kQuarters == kHalves, "both have as many lights");

size_t countOf(LightParts parts) {
    return size_t(parts.has(LightPart::Direct)) + size_t(parts.has(LightPart::Indirect));
}

void write(IntegerWriter& out, const RgbSum& sum) {
    for (const FixedPointSum& channel : sum.channels)
        out.add(channel.units());
}
void write(IntegerWriter& out, const CellSums& cell, LightParts parts) {
    const CellId& id = cell.id;
    out.add(int64_t(id.surface));
    const int64_t cube[] = {id.x, id.y, id.z};
    const int64_t rest[] = {id.level, id.face, cell.count[0], cell.count[1]};
    const int64_t means[] = {cell.p[0], cell.p[1], cell.p[2], cell.n[0], cell.n[1], cell.n[2]};
    out.addGroup(cube);
    out.addGroup(rest);
    out.addGroup(means);
    SumGroup sums;
    for (int part = 0; part < kParts; ++part)
        if (parts.has(LightPart(part)))
            for (const RgbSum& light : cell.light[part])
                sums.push(light);
    sums.write(out);
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
/// Reads the sums of a cell in a tile of this many pixels. Returns whether they are possible.
bool readCell(IntegerReader& in, size_t pixels, LightParts parts, CellSums& cell) {
    const auto isWithin = [](int64_t value, int64_t first, int64_t last) {
        return value >= first && value <= last;
    };
    int64_t cube[3], rest[4], means[6];
    cell.id.surface = uint64_t(in.next(INT64_MIN, INT64_MAX));
    in.nextGroup(cube);
    in.nextGroup(rest);
    in.nextGroup(means);
    SumGroup sums;
    sums.read(in, kHalves * 3 * countOf(parts));
    for (const int64_t index : cube)
        if (!isWithin(index, -CellId::kMaxIndex, CellId::kMaxIndex))
            return false;
    const auto maxCount = int64_t(std::min<uint64_t>(uint64_t(pixels) * kMaxSamples, UINT32_MAX));
    if (!isWithin(rest[0], -CellId::kMaxLevel, CellId::kMaxLevel) ||
        !isWithin(rest[1], 0, CellId::kFaces - 1) || !isWithin(rest[2], 0, maxCount) ||
        !isWithin(rest[3], 0, maxCount) || rest[2] + rest[3] == 0)
        return false;
    const int64_t total = rest[2] + rest[3];
    cell.id = {cell.id.surface,  int32_t(cube[0]), int32_t(cube[1]),
               int32_t(cube[2]), int16_t(rest[0]), uint16_t(rest[1])};
    for (int half = 0; half < kHalves; ++half)
        cell.count[half] = uint32_t(rest[2 + half]);
    for (int k = 0; k < 3; ++k) {
        cell.p[k] = means[k];
        cell.n[k] = means[3 + k];
        const int64_t maxNormal = total << CellSums::kNormalBits;
        if (!isWithin(cell.p[k], 0, total << CellSums::kPositionBits) ||
            !isWithin(cell.n[k], -maxNormal, maxNormal))
            return false;
    }
    for (int part = 0; part < kParts; ++part)
        if (parts.has(LightPart(part)))
            for (RgbSum& light : cell.light[part])
                sums.pop(light);
    return true;
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
    const int64_t counts[] = {half.quarters[0].count, half.quarters[1].count, int64_t(half.uses.size()),
                              int64_t(half.rare.size()), hasEmission(half)};
    out.addGroup(counts);
    if (half.count() == 0)
        return;
    SumGroup sums;
    sums.push(half.v);
    for (const HalfLight::Quarter& quarter : half.quarters)
        for (int part = 0; part < kParts; ++part)
            if (m_parts.has(LightPart(part)))
                sums.push(quarter.light[part]);
    sums.write(out);
    if (hasEmission(half)) {
        write(out, half.emitted);
        for (const FixedPointSum& moment : {half.ee, half.ve})
            out.add(moment.units());
    }
    writeUses(half.uses);
    for (const RareSample& sample : half.rare)
        write(out, sample);
}

void TileLight::writeUses(const std::vector<CellUse>& uses) {
    IntegerLength length;
    for (const CellUse& use : uses)
        for (const int64_t albedo : use.albedo)
            length.include(albedo);
    m_pixelBytes.addByte(length.bytes());
    for (const CellUse& use : uses)
        m_pixelBytes.addBytes(use.cell, sizeof use.cell);
    for (const CellUse& use : uses)
        for (const int64_t albedo : use.albedo)
            m_pixelBytes.addBytes(albedo, length.bytes());
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
    static const std::string_view kNoSamples("\0\0", kHalves); // groups of zeros
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
    const auto count = size_t(header.next(0, int64_t(header.left() / kMinCellBytes)));
    m_cells.resize(count);
    m_cellNumbers.resize(count);
    for (size_t i = 0; i < count; ++i) {
        if (!readCell(header, pixels, m_parts, m_cells[i]))
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
    int64_t counts[5];
    m_reader.nextGroup(counts);
    const auto [first, second, uses, rare, hasEmission] = counts;
    const auto left = int64_t(m_reader.left());
    if (first < 0 || first > kMaxSamples || second < 0 || second > kMaxSamples || uses < 0 || uses > left ||
        rare < 0 || rare > left)
        fail();
    half.quarters[0].count += uint32_t(first);
    half.quarters[1].count += uint32_t(second);
    if (first + second == 0)
        return;
    SumGroup sums;
    sums.read(m_reader, 1 + kQuarters * 3 * countOf(m_tile->m_parts));
    sums.pop(half.v);
    for (HalfLight::Quarter& quarter : half.quarters)
        for (int part = 0; part < kParts; ++part)
            if (m_tile->m_parts.has(LightPart(part)))
                sums.pop(quarter.light[part]);
    if (hasEmission) {
        strobe::addNext(m_reader, half.emitted);
        for (FixedPointSum* moment : {&half.ee, &half.ve})
            moment->add(FixedPointSum(m_reader.next()));
    }
    addUses(half, size_t(uses));
    addRare(half, size_t(rare));
}

void TileLightReader::Row::addUses(HalfLight& half, size_t count) {
    const size_t first = half.uses.size(), cellCount = m_tile->m_cellNumbers.size();
    const size_t length = m_reader.nextLength(sizeof(int64_t), 3 * count);
    if (m_reader.left() < count * (sizeof(uint32_t) + 3 * length))
        fail();
    half.uses.resize(first + count);
    m_reader.nextBytes(sizeof(uint32_t), count, [&](size_t i, int64_t cell) {
        if (uint64_t(cell) >= cellCount)
            fail();
        half.uses[first + i].cell = m_tile->m_cellNumbers[size_t(cell)];
    });
    auto use = half.uses.begin() + std::ptrdiff_t(first);
    int channel = 0;
    m_reader.nextBytes(length, 3 * count, [&](size_t, int64_t albedo) {
        use->albedo[channel] = albedo;
        if (++channel == 3) {
            channel = 0;
            ++use;
        }
    });
}

void TileLightReader::Row::addRare(HalfLight& half, size_t count) {
    if (count > m_reader.left() / kMinRareBytes)
        fail();
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
