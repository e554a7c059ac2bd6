// The recorded light of a tile, and its representation in the records of films and in files.
#pragma once

#include "core/film/film_records.h"
#include "core/film/pixel_accumulator.h"
#include "core/util/index_table.h"
#include "sharing/records/byte_stream.h"
#include "sharing/records/light_cells.h"

#include <span>

namespace strobe {

/// The quarters of each half of a pixel's samples.
inline constexpr int kQuarters = 2;

/// The sums of one half of a pixel's samples, weighted by the pixel filter.
struct HalfLight {
    struct Quarter {
        uint32_t count = 0;         ///< samples
        uint32_t negativeCount = 0; ///< of these: those with negative filter weights
        RgbSum light[kParts];       ///< the light at first vertices that their albedo modulates
        /// The sum of the filter weights.
        int32_t weight() const { return int32_t(count) - 2 * int32_t(negativeCount); }
    };
    Quarter quarters[kQuarters];
    RgbSum emitted; ///< FirstVertex::emitted
    /// Moments of the emission e and of the whole radiance v: means of the channels.
    FixedPointSum v, ee, ve;
    std::vector<CellUse> uses;
    std::vector<RareSample> rare;

    uint32_t count() const { return quarters[0].count + quarters[1].count; }
    int32_t weight() const { return quarters[0].weight() + quarters[1].weight(); }
    bool hasEmission() const;
    void clear();
};

/// Sorts uses by cell, with one entry per cell.
void sortUses(std::vector<CellUse>& uses);

struct PixelLight {
    HalfLight halves[kHalves];
    void clear() {
        for (HalfLight& half : halves)
            half.clear();
    }
};

/// Additional samples of the emission of a pixel.
struct EmissionSum {
    size_t pixel; ///< row by row in the tile
    PixelAccumulator sum;
};

/// Collects the light of the pixels of a tile and writes it as a record.
class TileLight {
  public:
    /// `parts`: those that are recorded; the sums of the others are 0.
    explicit TileLight(LightParts parts) : m_parts(parts) {}
    void clear();
    /// Returns the index of a cell, added if necessary.
    uint32_t findCell(const CellId& id) {
        if (m_lastCell < m_cells.size() && m_cells[m_lastCell].id == id)
            return m_lastCell;
        return findOtherCell(id);
    }
    /// All cells, by index.
    const std::vector<CellSums>& cells() const { return m_cells; }
    /// Returns a cell by its index.
    CellSums& cell(uint32_t index) { return m_cells[index]; }
    /// Adds a pixel of the tile; each at most once.
    void addPixel(int x, int y, const PixelLight& light);
    /// Adds samples of the emission of a pixel.
    void addEmission(int x, int y, const PixelAccumulator& sum) { m_emission.push_back({x, y, sum}); }
    /// Returns the record of the pixels of `tile`. Pixels that were not added have no samples.
    FilmRecord record(const PixelBounds& tile, const SampleSlice& samples);

  private:
    struct PixelEntry {
        int x, y;
        size_t first, size; ///< in m_pixelBytes
    };
    struct EmissionEntry {
        int x, y;
        PixelAccumulator sum;
    };
    uint32_t findOtherCell(const CellId& id);
    void writeHalf(const HalfLight& half);
    void writeRare(const std::vector<RareSample>& samples);
    void writeHeader(const PixelBounds& tile);
    size_t sizeOfRows(const PixelBounds& tile) const;
    void writeRows(const PixelBounds& tile, char* out) const;

    const LightParts m_parts;
    std::vector<CellSums> m_cells;
    IndexTable m_cellIndices; ///< by CellId::hash
    uint32_t m_lastCell = 0;  ///< found last
    std::vector<PixelEntry> m_pixels;
    ByteWriter m_pixelBytes; ///< pixel by pixel, in the order of m_pixels
    std::vector<EmissionEntry> m_emission;
    ByteWriter m_header; ///< a buffer
    ByteArena m_arena;   ///< of the records
};

/// Returns one of several sums in a record, of 8 bytes or, if they are long, of 16.
inline FixedPointSum sumAt(const char* sums, bool isLong, size_t index) {
    return FixedPointSum(isLong ? numberAt<__int128>(sums + index * sizeof(__int128))
                                : numberAt<int64_t>(sums + index * sizeof(int64_t)));
}

/// One half of a pixel's samples in a record. Cells have the indices of the record.
struct HalfBytes {
    // By quarter:
    uint32_t counts[kQuarters] = {};         ///< samples
    uint32_t negativeCounts[kQuarters] = {}; ///< of these: those with negative filter weights
    uint32_t useCount = 0, rareCount = 0;
    bool isLong = false;
    // Null: none.
    const char *sums = nullptr, *uses = nullptr, *emission = nullptr, *rare = nullptr;

    /// Returns the sum of the filter weights of a quarter.
    int32_t weight(int quarter) const {
        return int32_t(counts[quarter]) - 2 * int32_t(negativeCounts[quarter]);
    }
    /// Returns a sum: HalfLight::v, then those of the recorded parts, by quarter, part and channel.
    FixedPointSum sum(size_t index) const { return sumAt(sums, isLong, index); }
    /// Returns a channel of HalfLight::emitted, then ee and ve.
    FixedPointSum emissionSum(size_t index) const;
    CellUse use(size_t index) const;
    RareSample rareSample(size_t index) const;
};

/// Reads a record of TileLight. All functions throw Error of kind Usage if the record is damaged.
class TileLightReader {
  public:
    explicit TileLightReader(FilmRecord record);
    const PixelBounds& pixels() const { return m_record.pixels; }
    const SampleSlice& samples() const { return m_record.samples; }
    LightParts parts() const { return m_parts; }
    size_t cellCount() const { return m_cellNumbers.size(); }
    /// Calls work(cell) for all cells in the order of their indices.
    template <class Work>
    void forCells(const Work& work) const {
        ByteReader reader(m_cellBytes);
        for (size_t i = 0; i < cellCount(); ++i)
            work(nextCell(reader));
    }
    const std::vector<EmissionSum>& emission() const { return m_emission; }
    /// Sets the numbers that replace the indices of the cells in the pixels' uses. Initially, these are the
    /// indices.
    void setCellNumbers(std::vector<uint32_t> numbers) { m_cellNumbers = std::move(numbers); }

    /// Reads the pixels of a row, from the first one on.
    class Row {
      public:
        const TileLightReader& tile() const { return *m_tile; }
        /// Reads the next half of a pixel.
        HalfBytes nextHalf();

      private:
        friend class TileLightReader;
        Row(const TileLightReader& tile, std::string_view bytes) : m_tile(&tile), m_reader(bytes) {}
        const TileLightReader* m_tile;
        ByteReader m_reader;
    };
    /// Returns the row y of the frame, which is in pixels(). The reader outlives it.
    Row row(int y) const;
    // Add the numbers of a half to `out`. The indices of cells are replaced: see setCellNumbers.
    void addUses(const HalfBytes& half, std::vector<CellUse>& out) const;
    void addRare(const HalfBytes& half, std::vector<RareSample>& out) const;
    void add(const HalfBytes& half, HalfLight& out) const;

  private:
    [[noreturn]] static void fail();
    uint32_t numberOf(uint32_t cell) const {
        if (cell >= m_cellNumbers.size())
            fail();
        return m_cellNumbers[cell];
    }
    void skipCells(ByteReader& header);
    CellSums nextCell(ByteReader& reader) const;
    void readEmission(ByteReader& header);

    FilmRecord m_record;
    LightParts m_parts;
    std::string_view m_cellBytes;
    std::vector<EmissionSum> m_emission;
    std::vector<uint32_t> m_cellNumbers;
    size_t m_rowsStart = 0, m_rowTable = 0; ///< positions in the record
};

} // namespace strobe
