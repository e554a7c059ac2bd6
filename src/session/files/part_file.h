// Part files, which are written and read block by block: sums of rows of pixels, and records.
#pragma once

#include "core/film/film.h"
#include "session/files/part.h"

#include <functional>
#include <istream>

namespace strobe {

/// Collects a part and writes it to a file: a line with the format and version, a line of JSON with its
/// checksum, and compressed blocks with checksums.
class PartWriter {
  public:
    explicit PartWriter(const PartHeader& part);
    /// Adds the sums of the pixels of the boxes, from those of all pixels of the part's bounds, row by row.
    void addSums(const std::vector<PixelAccumulator>& sums);
    /// Adds a record of samples of the boxes.
    void addRecord(const FilmRecord& record);
    /// Adds the AOVs of samples of the boxes: see storeLayers.
    void addLayers(const FilmRecord& record);
    /// Completes the part, and returns the bytes of its file; once.
    std::string finish();
    /// Completes the part, and replaces the file atomically. Throws Error of kind Output.
    void write(const std::filesystem::path& file);

  private:
    const PartHeader& m_part;
    const CoveredPixels m_pixels;
    std::string m_bytes;
};

/// Receives what PartReader::read reads.
struct PartSink {
    std::function<void(int x, int y, const PixelAccumulator& sum)> sum; ///< each pixel of the boxes, once
    std::function<void(FilmRecord)> record;
    std::function<void(FilmRecord)> layers;
};

/// Reads a part file. All functions throw Error of kind Usage if it cannot be read, is not a part, is damaged
/// or truncated.
class PartReader {
  public:
    /// Reads the header.
    explicit PartReader(const std::filesystem::path& file);
    /// As above, from a stream. `file` names it in errors.
    PartReader(std::unique_ptr<std::istream> stream, const std::filesystem::path& file);
    const PartHeader& header() const { return m_part; }
    /// Reads the samples; once. Memory: that of one block.
    void read(const PartSink& sink);

  private:
    struct Block;
    [[noreturn]] void fail(const std::string& reason) const;
    void readHeader();
    std::string readLine(size_t maxSize);
    std::string readBytes(uint64_t size);
    Block readBlock();
    int readSums(const Block& block, const CoveredPixels& pixels, int y, const PartSink& sink) const;

    const std::filesystem::path m_file;
    std::unique_ptr<std::istream> m_stream;
    PartHeader m_part;
};

/// Adds the sums and the records to a film whose pixel bounds contain those of the part, and sets the note of
/// the film's records. The film keeps sums, unless it is empty.
void addToFilm(PartReader& part, Film& film);

} // namespace strobe
