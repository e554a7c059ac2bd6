// The picture so far, for those who look at it while it is rendered.
#pragma once

#include "core/film/film.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

namespace strobe {

/// A copy of the film that renderers update tile by tile and onlookers read, each at its own pace: what
/// nobody fetched in time is overwritten by what is newer, so that nobody waits for an onlooker, and nothing
/// piles up.
class LiveFilm {
  public:
    /// `like`: its size and layers, and whether it keeps sums.
    explicit LiveFilm(const Film& like);

    /// Copies what `film` has in a tile of the window. From any thread.
    void update(const Film& film, const PixelBounds& tile);
    /// A copy.
    Film film() const;
    const PixelBounds& pixelBounds() const { return m_pixelBounds; }

    /// A piece of the picture, in pixels of the full frame.
    struct Piece {
        PixelBounds pixelBounds;
        Image image;
    };
    /// For one onlooker: a piece that has changed since it was fetched, the longest waiting first. Waits for
    /// one; none: nothing has changed for `patience`.
    std::optional<Piece> nextChanged(std::chrono::milliseconds patience);
    /// All that is in the picture counts as changed: for an onlooker who comes late.
    void touchAll();

  private:
    void touch(const PixelBounds& tile);

    const PixelBounds m_pixelBounds;
    mutable std::mutex m_mutex;
    std::condition_variable m_changed;
    Film m_film;
    // Pieces of the window, row by row:
    int m_across, m_down;
    std::vector<bool> m_filled, m_waits;
    std::vector<int> m_queue; ///< those that wait, each once; from m_head on
    size_t m_head = 0;
};

} // namespace strobe
