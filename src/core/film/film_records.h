// Records that an integrator adds to a film, besides the samples of the pixels.
#pragma once

#include "core/film/shared_bytes.h"
#include "core/math/api.h"
#include "core/math/pixel_bounds.h"
#include "core/math/sample_slice.h"

#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace STROBE_API strobe {

/// Data about the samples of a rectangle of pixels. The integrator that wrote them defines their format.
/// Records of disjoint samples can be added.
struct FilmRecord {
    PixelBounds pixels;
    SampleSlice samples;
    SharedBytes bytes;
};

/// The records of a film. All functions are thread-safe. Copies share the bytes.
class FilmRecords {
  public:
    FilmRecords() = default;
    FilmRecords(const FilmRecords& other);
    FilmRecords& operator=(const FilmRecords& other);

    /// Returns the decision of the integrator's pilot, as text: see IntegratorState::note.
    std::string note() const;
    void setNote(std::string note);

    void add(FilmRecord record);
    /// Adds the records of another film, and takes its note if this one has none.
    void add(const FilmRecords& other);
    /// Replaces the records that lie within the tile by those of another film, and takes its note.
    void copyFrom(const FilmRecords& source, const PixelBounds& tile);
    /// Removes the records that lie within the tile.
    void remove(const PixelBounds& tile);
    /// Removes all records; keeps the note.
    void clear();
    /// Replaces all records.
    void set(std::vector<FilmRecord> records);
    /// Returns the records by ascending rows, then columns, of their first pixels.
    std::vector<FilmRecord> all() const;
    bool isEmpty() const;

  private:
    /// By the row and the column of the first pixel.
    using Map = std::multimap<std::pair<int, int>, FilmRecord>;
    static void insert(Map& map, FilmRecord record);
    std::vector<FilmRecord> within(const PixelBounds& tile) const;

    mutable std::mutex m_mutex;
    Map m_records;      ///< guarded by m_mutex, as is m_note
    std::string m_note; ///< empty: none
};

} // namespace strobe
