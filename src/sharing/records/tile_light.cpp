#include "sharing/records/tile_light.h"

#include "sharing/records/tile_light_format.h"

#include <algorithm>

namespace strobe {

using namespace tile_light_format;

namespace {

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

/// The flags of a pixel without samples.
const std::string_view kNoSamples("\0\0", kHalves);

/// Copies bytes. Returns the end of the copy.
char* append(std::string_view bytes, char* out) { return std::copy(bytes.begin(), bytes.end(), out); }

} // namespace

bool HalfLight::hasEmission() const {
    return !(emitted == RgbSum() && ee == FixedPointSum() && ve == FixedPointSum());
}

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
    const bool hasNegative = half.weight() != int32_t(half.count());
    if (hasNegative)
        for (const HalfLight::Quarter& quarter : half.quarters)
            out.add(quarter.negativeCount);
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
    const bool emits = half.hasEmission();
    if (emits) {
        const auto write = [&](const FixedPointSum& sum) { out.add(sum.units()); };
        forChannels(half.emitted, write);
        write(half.ee);
        write(half.ve);
    }
    if (!half.rare.empty())
        writeRare(half.rare);
    out.set(start, uint8_t(kHasSamples | (isLong ? kHasLongSums : 0) | (emits ? kHasEmission : 0) |
                           (half.rare.empty() ? 0 : kHasRare) | (hasNegative ? kHasNegative : 0)));
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

/// Returns the number of bytes of the rows and of the table of their ends.
size_t TileLight::sizeOfRows(const PixelBounds& tile) const {
    return size_t(tile.height()) * sizeof(RowEnd) + m_pixelBytes.size() +
           kNoSamples.size() * (pixelCount(tile) - m_pixels.size());
}

/// Writes the ends of the rows, in bytes from the start of the first row, and the rows.
void TileLight::writeRows(const PixelBounds& tile, char* out) const {
    constexpr size_t kAbsent = ~size_t(0);
    std::vector<size_t> entryOf(pixelCount(tile), kAbsent);
    for (size_t i = 0; i < m_pixels.size(); ++i)
        entryOf[size_t(m_pixels[i].y - tile.y0) * size_t(tile.width()) + size_t(m_pixels[i].x - tile.x0)] = i;
    char* const rows = out + size_t(tile.height()) * sizeof(RowEnd);
    char* next = rows;
    for (int y = 0; y < tile.height(); ++y) {
        for (int x = 0; x < tile.width(); ++x) {
            const size_t entry = entryOf[size_t(y) * size_t(tile.width()) + size_t(x)];
            next = append(entry == kAbsent
                              ? kNoSamples
                              : m_pixelBytes.bytes().substr(m_pixels[entry].first, m_pixels[entry].size),
                          next);
        }
        const RowEnd end = size_t(next - rows);
        std::memcpy(out + size_t(y) * sizeof end, &end, sizeof end);
    }
}

FilmRecord TileLight::record(const PixelBounds& tile, const SampleSlice& samples) {
    writeHeader(tile);
    const size_t size = m_header.size() + m_emission.size() * PixelAccumulator::kBytes + sizeOfRows(tile);
    const std::shared_ptr<char> bytes = m_arena.allocate(size);
    char* next = append(m_header.bytes(), bytes.get());
    for (const EmissionEntry& entry : m_emission) {
        entry.sum.store(next);
        next += PixelAccumulator::kBytes;
    }
    writeRows(tile, next);
    return {tile, samples, SharedBytes(bytes, size)};
}

} // namespace strobe
