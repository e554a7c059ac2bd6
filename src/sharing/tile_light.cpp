#include "sharing/tile_light.h"

#include "core/util/error.h"

#include <algorithm>
#include <bit>

namespace strobe {

namespace {

/// Changes with the meaning of the numbers of records.
constexpr uint32_t kFormat = 4;
constexpr uint32_t kMaxSamples = PixelAccumulator::kMaxSamples;
constexpr size_t kSumsOfHalf = 1 + 3 * kParts * kQuarters;
/// The bytes of sums of which one is longer than 64 bits.
constexpr size_t kLongSum = sizeof(__int128);
// The maximum numbers of bytes:
constexpr size_t kCellBytes = sizeof(CellSums) + 1, kEmissionBytes = 5 * kLongSum;
constexpr size_t kHalfBytes = 1 + 4 * sizeof(uint32_t) + kSumsOfHalf * kLongSum + kEmissionBytes;
// The exact ones:
constexpr size_t kUseBytes = sizeof(uint32_t) + 3 * sizeof(int64_t), kRareBytes = 6 + 6 * sizeof(float);
/// The minimum number of bytes of a cell.
constexpr size_t kMinCellBytes = 85;
/// The rows of pixels are preceded by a table of the ends of rows.
using RowEnd = uint64_t;

/// What half of a pixel holds; 0: it has no samples.
enum HalfFlags : uint8_t { kHasSamples = 1, kHasLongSums = 2, kHasEmission = 4, kHasRare = 8 };

size_t pixelCount(const PixelBounds& bounds) { return size_t(bounds.width()) * size_t(bounds.height()); }

size_t countOf(LightParts parts) {
    return size_t(parts.has(LightPart::Direct)) + size_t(parts.has(LightPart::Indirect));
}

/// Writes sums with a common length, which `isLong` tells after that.
class SumWriter {
  public:
    explicit SumWriter(ByteWriter& out) : m_out(out), m_next(out.end()) {}
    /// Writes 8 bytes.
    void addShort(const FixedPointSum& sum) {
        const __int128 units = sum.units();
        const auto low = int64_t(units);
        std::memcpy(m_next, &low, sizeof low);
        m_next += sizeof low;
        m_excess |= uint64_t(int64_t(units >> 64) ^ (low >> 63));
    }
    /// Writes 16 bytes.
    void addLong(const FixedPointSum& sum) { m_out.add(sum.units()); }
    bool isLong() const { return m_excess != 0; }
    /// Keeps what addShort wrote.
    void finishShort() { m_out.setEnd(m_next); }

  private:
    ByteWriter& m_out;
    char* m_next;
    uint64_t m_excess = 0; ///< not 0: a sum does not fit into 8 bytes
};

/// Writes the sums for which forSums(work) calls work(sum). Returns whether they are long.
template <class ForSums>
bool writeSums(ByteWriter& out, const ForSums& forSums) {
    SumWriter writer(out);
    forSums([&](const FixedPointSum& sum) { writer.addShort(sum); });
    if (writer.isLong())
        forSums([&](const FixedPointSum& sum) { writer.addLong(sum); });
    else
        writer.finishShort();
    return writer.isLong();
}

template <class Work>
void forChannels(const RgbSum& sum, const Work& work) {
    for (const FixedPointSum& channel : sum.channels)
        work(channel);
}

bool hasEmission(const HalfLight& half) {
    return !(half.emitted == RgbSum() && half.ee == FixedPointSum() && half.ve == FixedPointSum());
}

void write(ByteWriter& out, const CellSums& cell, LightParts parts) {
    const size_t start = out.size();
    out.add(uint8_t(0));
    const CellId& id = cell.id;
    out.add(id.surface);
    for (const int32_t index : {id.x, id.y, id.z})
        out.add(index);
    out.add(id.level);
    out.add(id.face);
    for (const uint32_t count : cell.count)
        out.add(count);
    for (int k = 0; k < 3; ++k) {
        out.add(cell.p[k]);
        out.add(cell.n[k]);
    }
    const bool isLong = writeSums(out, [&](const auto& work) {
        for (int part = 0; part < kParts; ++part)
            if (parts.has(LightPart(part)))
                for (const RgbSum& light : cell.light[part])
                    forChannels(light, work);
    });
    out.set(start, uint8_t(isLong));
}

/// Reads a cell. Returns whether it is possible in a tile of this many pixels.
bool readCell(ByteReader& in, size_t pixels, LightParts parts, CellSums& cell) {
    const bool isLong = in.next<uint8_t>() != 0;
    CellId& id = cell.id;
    id.surface = in.next<uint64_t>();
    bool isValid = true;
    for (int32_t* index : {&id.x, &id.y, &id.z}) {
        *index = in.next<int32_t>();
        isValid &= *index >= -CellId::kMaxIndex && *index <= CellId::kMaxIndex;
    }
    id.level = in.next<int16_t>();
    id.face = in.next<uint16_t>();
    isValid &= std::abs(int(id.level)) <= CellId::kMaxLevel && id.face < CellId::kFaces;
    int64_t total = 0;
    for (uint32_t& count : cell.count) {
        count = in.next<uint32_t>();
        isValid &= count <= uint64_t(pixels) * kMaxSamples;
        total += count;
    }
    isValid &= total > 0;
    const int64_t maxNormal = total << CellSums::kNormalBits;
    for (int k = 0; k < 3; ++k) {
        cell.p[k] = in.next<int64_t>();
        cell.n[k] = in.next<int64_t>();
        isValid &= cell.p[k] >= 0 && cell.p[k] <= total << CellSums::kPositionBits &&
                   cell.n[k] >= -maxNormal && cell.n[k] <= maxNormal;
    }
    const char* sums = in.skip(kHalves * 3 * countOf(parts) * (isLong ? kLongSum : sizeof(int64_t)));
    if (!sums || !isValid)
        return false;
    size_t next = 0;
    for (int part = 0; part < kParts; ++part)
        if (parts.has(LightPart(part)))
            for (RgbSum& light : cell.light[part])
                for (FixedPointSum& channel : light.channels)
                    channel = sumAt(sums, isLong, next++);
    return true;
}

Rgb colorAt(const char* bytes) {
    return {numberAt<float>(bytes), numberAt<float>(bytes + sizeof(float)),
            numberAt<float>(bytes + 2 * sizeof(float))};
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

void sortUses(std::vector<CellUse>& uses) {
    // Most are few.
    for (size_t i = 1; i < uses.size(); ++i)
        if (uses[i].cell <= uses[i - 1].cell) {
            std::sort(uses.begin(), uses.end(),
                      [](const CellUse& a, const CellUse& b) { return a.cell < b.cell; });
            break;
        }
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
    ByteWriter& out = m_pixelBytes;
    out.reserve(kHalfBytes + half.uses.size() * kUseBytes + half.rare.size() * kRareBytes);
    if (half.count() == 0) {
        out.add(uint8_t(0));
        return;
    }
    const size_t start = out.size();
    out.add(uint8_t(0));
    for (const HalfLight::Quarter& quarter : half.quarters)
        out.add(quarter.count);
    out.add(uint32_t(half.uses.size()));
    const bool isLong = writeSums(out, [&](const auto& work) {
        work(half.v);
        for (const HalfLight::Quarter& quarter : half.quarters)
            for (int part = 0; part < kParts; ++part)
                if (m_parts.has(LightPart(part)))
                    forChannels(quarter.light[part], work);
    });
    char* next = out.end();
    for (const CellUse& use : half.uses) {
        std::memcpy(next, &use.cell, sizeof use.cell);
        std::memcpy(next + sizeof use.cell, use.albedo, sizeof use.albedo);
        next += kUseBytes;
    }
    out.setEnd(next);
    const bool emits = hasEmission(half);
    if (emits) {
        const auto write = [&](const FixedPointSum& sum) { out.add(sum.units()); };
        forChannels(half.emitted, write);
        write(half.ee);
        write(half.ve);
    }
    if (!half.rare.empty())
        writeRare(half.rare);
    out.set(start, uint8_t(kHasSamples | (isLong ? kHasLongSums : 0) | (emits ? kHasEmission : 0) |
                           (half.rare.empty() ? 0 : kHasRare)));
}

void TileLight::writeRare(const std::vector<RareSample>& samples) {
    m_pixelBytes.add(uint32_t(samples.size()));
    for (const RareSample& sample : samples) {
        m_pixelBytes.add(sample.cell);
        m_pixelBytes.add(sample.part);
        m_pixelBytes.add(uint8_t(sample.isInQuarter));
        for (const Rgb& color : {sample.light, sample.albedo})
            for (int c = 0; c < 3; ++c)
                m_pixelBytes.add(color[c]);
    }
}

void TileLight::writeHeader(const PixelBounds& tile) {
    m_header.clear();
    m_header.reserve(2 * sizeof(uint32_t) + 2 * sizeof(uint64_t) + m_cells.size() * kCellBytes +
                     m_emission.size() * sizeof(uint64_t));
    m_header.add(kFormat);
    m_header.add(m_parts.bits());
    m_header.add(uint64_t(m_cells.size()));
    for (const CellSums& cell : m_cells)
        write(m_header, cell, m_parts);
    m_header.add(uint64_t(m_emission.size()));
    for (const EmissionEntry& entry : m_emission)
        m_header.add(uint64_t(entry.y - tile.y0) * uint64_t(tile.width()) + uint64_t(entry.x - tile.x0));
}

/// Appends the ends of the rows, in bytes from the start of the first row, and the rows.
void TileLight::writeRows(const PixelBounds& tile, std::string& out) {
    static const std::string_view kNoSamples("\0\0", kHalves); // flags
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
    ByteReader header(*m_record.bytes);
    if (header.next<uint32_t>() != kFormat)
        fail();
    const auto bits = header.next<uint32_t>();
    m_parts = LightParts(bits);
    if (bits >= 1 << kParts)
        fail();
    readCells(header);
    readEmission(header);
    m_rowTable = header.position() + m_emission.size() * PixelAccumulator::kBytes;
    m_rowsStart = m_rowTable + size_t(m_record.pixels.height()) * sizeof(RowEnd);
    if (m_rowsStart > m_record.bytes->size())
        fail();
}

void TileLightReader::readCells(ByteReader& header) {
    const size_t pixels = pixelCount(m_record.pixels);
    const auto count = header.next<uint64_t>();
    if (count > header.left() / kMinCellBytes)
        fail();
    m_cells.resize(count);
    m_cellNumbers.resize(count);
    for (size_t i = 0; i < count; ++i) {
        if (!readCell(header, pixels, m_parts, m_cells[i]))
            fail();
        m_cellNumbers[i] = uint32_t(i);
    }
}

void TileLightReader::readEmission(ByteReader& header) {
    const auto count = header.next<uint64_t>();
    if (header.hasFailed() || count > header.left() / (sizeof(uint64_t) + PixelAccumulator::kBytes))
        fail();
    m_emission.resize(count);
    for (EmissionSum& emission : m_emission) {
        emission.pixel = header.next<uint64_t>();
        if (emission.pixel >= pixelCount(m_record.pixels))
            fail();
    }
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

HalfBytes TileLightReader::Row::nextHalf() {
    HalfBytes half;
    const auto flags = m_reader.next<uint8_t>();
    half.isLong = flags & kHasLongSums;
    if (flags & kHasSamples) {
        for (uint32_t& count : half.counts)
            count = m_reader.next<uint32_t>();
        half.useCount = m_reader.next<uint32_t>();
        half.sums = m_reader.skip((1 + kQuarters * 3 * countOf(m_tile->m_parts)) *
                                  (half.isLong ? kLongSum : sizeof(int64_t)));
        half.uses = m_reader.skip(half.useCount * kUseBytes);
        if (flags & kHasEmission)
            half.emission = m_reader.skip(kEmissionBytes);
        if (flags & kHasRare) {
            half.rareCount = m_reader.next<uint32_t>();
            half.rare = m_reader.skip(half.rareCount * kRareBytes);
        }
        if (std::max(half.counts[0], half.counts[1]) > kMaxSamples)
            fail();
    }
    if (m_reader.hasFailed())
        fail();
    return half;
}

FixedPointSum HalfBytes::emissionSum(size_t index) const { return sumAt(emission, true, index); }

CellUse HalfBytes::use(size_t index) const {
    const char* bytes = uses + index * kUseBytes;
    CellUse out;
    out.cell = numberAt<uint32_t>(bytes);
    std::memcpy(out.albedo, bytes + sizeof out.cell, sizeof out.albedo);
    return out;
}

RareSample HalfBytes::rareSample(size_t index) const {
    const char* bytes = rare + index * kRareBytes;
    return {numberAt<uint32_t>(bytes), numberAt<uint8_t>(bytes + 4), numberAt<uint8_t>(bytes + 5) == 1,
            colorAt(bytes + 6), colorAt(bytes + 6 + 3 * sizeof(float))};
}

void TileLightReader::addUses(const HalfBytes& half, std::vector<CellUse>& out) const {
    for (size_t i = 0; i < half.useCount; ++i) {
        out.push_back(half.use(i));
        out.back().cell = numberOf(out.back().cell);
    }
}

void TileLightReader::addRare(const HalfBytes& half, std::vector<RareSample>& out) const {
    for (size_t i = 0; i < half.rareCount; ++i) {
        RareSample sample = half.rareSample(i);
        if (sample.part >= kParts || !isFinite(sample.light) || !isFinite(sample.albedo))
            fail();
        sample.cell = numberOf(sample.cell);
        out.push_back(sample);
    }
}

void TileLightReader::add(const HalfBytes& half, HalfLight& out) const {
    if (!half.sums)
        return;
    size_t next = 0;
    out.v.add(half.sum(next++));
    for (int k = 0; k < kQuarters; ++k) {
        out.quarters[k].count += half.counts[k];
        for (int part = 0; part < kParts; ++part)
            if (m_parts.has(LightPart(part)))
                for (FixedPointSum& channel : out.quarters[k].light[part].channels)
                    channel.add(half.sum(next++));
    }
    if (half.emission) {
        for (size_t c = 0; c < 3; ++c)
            out.emitted.channels[c].add(half.emissionSum(c));
        out.ee.add(half.emissionSum(3));
        out.ve.add(half.emissionSum(4));
    }
    addUses(half, out.uses);
    addRare(half, out.rare);
}

} // namespace strobe
