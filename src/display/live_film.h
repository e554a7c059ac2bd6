// A copy of the film that viewers and writers read while it is rendered.
#pragma once

#include "core/film/film.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

namespace strobe {

/// A copy of a film, updated tile by tile by the renderer and read by other threads. A slow reader does not
/// delay the renderer: tiles that it has not fetched are overwritten. Thread-safe.
class LiveFilm {
  public:
    /// Makes an empty film with the size and layers of `film`; it keeps sums if `film` does.
    explicit LiveFilm(const Film& film);

    /// Copies the pixels of `bounds` from a film of the same size and layers.
    void update(const Film& film, const PixelBounds& bounds);
    /// Returns a copy.
    Film film() const;
    const PixelBounds& pixelBounds() const { return m_pixelBounds; }

    /// Up to 64x64 pixels.
    struct Tile {
        PixelBounds pixelBounds; ///< in the full frame
        Image image;
    };
    /// Returns the tile that changed first since it was last returned. Waits for a change until the timeout,
    /// then returns none. For a single reader.
    std::optional<Tile> nextChanged(std::chrono::milliseconds timeout);
    /// Marks all rendered tiles as changed, for a reader that starts late.
    void markAllChanged();

  private:
    void markChanged(const PixelBounds& bounds);
    PixelBounds boundsOf(int tile) const;

    const PixelBounds m_pixelBounds;
    mutable std::mutex m_mutex;
    std::condition_variable m_changed;
    Film m_film;
    const int m_columns, m_rows;                 ///< of tiles
    std::vector<bool> m_isRendered, m_isChanged; ///< by tile, row by row
    std::vector<int> m_queue;                    ///< changed tiles, each once, from m_head on
    size_t m_head = 0;
};

} // namespace strobe
