#include "core/util/error.h"
#include "sharing/records/tile_light_format.h"

#include <algorithm>

namespace strobe {

using namespace tile_light_format;

namespace {

/// Returns the size of the sums of a cell.
size_t sizeOfSums(bool isLong, LightParts parts) {
    return kHalves * 3 * countOf(parts) * (isLong ? kLongSum : sizeof(int64_t));
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
    const char* sums = in.skip(sizeOfSums(isLong, parts));
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

void TileLightReader::fail() { throw Error("the record of a tile is damaged", ErrorKind::Usage); }

TileLightReader::TileLightReader(FilmRecord record) : m_record(std::move(record)) {
    ByteReader header(m_record.bytes.view());
    if (header.next<uint32_t>() != kFormat)
        fail();
    const auto bits = header.next<uint32_t>();
    m_parts = LightParts(bits);
    if (bits >= 1 << kParts)
        fail();
    skipCells(header);
    readEmission(header);
    m_rowTable = header.position() + m_emission.size() * PixelAccumulator::kBytes;
    m_rowsStart = m_rowTable + size_t(m_record.pixels.height()) * sizeof(RowEnd);
    if (m_rowsStart > m_record.bytes.size())
        fail();
}

void TileLightReader::skipCells(ByteReader& header) {
    const auto count = header.next<uint64_t>();
    if (count > header.left() / kMinCellBytes)
        fail();
    m_cellNumbers.resize(count);
    const size_t first = header.position();
    for (size_t i = 0; i < count; ++i) {
        const bool isLong = header.next<uint8_t>() != 0;
        header.skip(kMinCellBytes - 1 + sizeOfSums(isLong, m_parts));
        m_cellNumbers[i] = uint32_t(i);
    }
    m_cellBytes = m_record.bytes.view().substr(first, header.position() - first);
}

CellSums TileLightReader::nextCell(ByteReader& reader) const {
    CellSums cell;
    if (!readCell(reader, pixelCount(m_record.pixels), m_parts, cell))
        fail();
    return cell;
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
        m_emission[i].sum.load(m_record.bytes.view().data() + header.position() +
                               i * PixelAccumulator::kBytes);
}

TileLightReader::Row TileLightReader::row(int y) const {
    const std::string_view bytes = m_record.bytes.view();
    RowEnd first = 0, end = 0;
    const char* table = bytes.data() + m_rowTable;
    const auto index = size_t(y - m_record.pixels.y0);
    if (index > 0)
        std::memcpy(&first, table + (index - 1) * sizeof first, sizeof first);
    std::memcpy(&end, table + index * sizeof end, sizeof end);
    if (first > end || end > bytes.size() - m_rowsStart)
        fail();
    return {*this, bytes.substr(m_rowsStart + first, end - first)};
}

HalfBytes TileLightReader::Row::nextHalf() {
    HalfBytes half;
    const auto flags = m_reader.next<uint8_t>();
    half.isLong = flags & kHasLongSums;
    if (flags & kHasSamples) {
        for (uint32_t& count : half.counts)
            count = m_reader.next<uint32_t>();
        if (flags & kHasNegative)
            for (uint32_t& count : half.negativeCounts)
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
        for (int k = 0; k < kQuarters; ++k)
            if (half.counts[k] > kMaxSamples || half.negativeCounts[k] > half.counts[k])
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
        if (sample.part >= kParts || !m_parts.has(LightPart(sample.part)) || !isFinite(sample.light) ||
            !isFinite(sample.albedo))
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
        out.quarters[k].negativeCount += half.negativeCounts[k];
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
