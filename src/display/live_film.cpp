#include "display/live_film.h"

namespace strobe {

namespace {

constexpr int kTileSize = 64; ///< pixels along a side

int tileCount(int pixels) { return (pixels + kTileSize - 1) / kTileSize; }

} // namespace

LiveFilm::LiveFilm(const Film& film)
    : m_pixelBounds(film.pixelBounds()),
      m_film(film.fullWidth(), film.fullHeight(), film.pixelBounds(), film.layers()),
      m_columns(tileCount(m_pixelBounds.width())), m_rows(tileCount(m_pixelBounds.height())),
      m_isRendered(size_t(m_columns) * size_t(m_rows)), m_isChanged(m_isRendered.size()) {
    if (!film.sums().empty())
        m_film.enableAccumulation();
}

void LiveFilm::update(const Film& film, const PixelBounds& bounds) {
    {
        const std::lock_guard lock(m_mutex);
        m_film.copyFrom(film, bounds);
        markChanged(bounds);
    }
    m_changed.notify_one();
}

void LiveFilm::markChanged(const PixelBounds& bounds) {
    const int firstColumn = (bounds.x0 - m_pixelBounds.x0) / kTileSize;
    const int lastColumn = (bounds.x1 - 1 - m_pixelBounds.x0) / kTileSize;
    const int lastRow = (bounds.y1 - 1 - m_pixelBounds.y0) / kTileSize;
    for (int row = (bounds.y0 - m_pixelBounds.y0) / kTileSize; row <= lastRow; ++row)
        for (int column = firstColumn; column <= lastColumn; ++column) {
            const int tile = row * m_columns + column;
            m_isRendered[size_t(tile)] = true;
            if (m_isChanged[size_t(tile)])
                continue;
            m_isChanged[size_t(tile)] = true;
            m_queue.push_back(tile);
        }
}

void LiveFilm::markAllChanged() {
    const std::lock_guard lock(m_mutex);
    for (size_t i = 0; i < m_isRendered.size(); ++i)
        if (m_isRendered[i] && !m_isChanged[i]) {
            m_isChanged[i] = true;
            m_queue.push_back(int(i));
        }
}

Film LiveFilm::film() const {
    const std::lock_guard lock(m_mutex);
    return m_film;
}

PixelBounds LiveFilm::boundsOf(int tile) const {
    const int x = m_pixelBounds.x0 + tile % m_columns * kTileSize;
    const int y = m_pixelBounds.y0 + tile / m_columns * kTileSize;
    return {x, y, std::min(x + kTileSize, m_pixelBounds.x1), std::min(y + kTileSize, m_pixelBounds.y1)};
}

std::optional<LiveFilm::Tile> LiveFilm::nextChanged(std::chrono::milliseconds timeout) {
    std::unique_lock lock(m_mutex);
    if (!m_changed.wait_for(lock, timeout, [&] { return m_head < m_queue.size(); }))
        return {};
    const int index = m_queue[m_head++];
    if (m_head == m_queue.size() || m_head > m_isRendered.size()) {
        m_queue.erase(m_queue.begin(), m_queue.begin() + ptrdiff_t(m_head));
        m_head = 0;
    }
    m_isChanged[size_t(index)] = false;
    const PixelBounds bounds = boundsOf(index);
    Tile tile{bounds, {bounds.width(), bounds.height(), {}}};
    for (int y = bounds.y0; y < bounds.y1; ++y) {
        const Rgb* row = &m_film.image().at(bounds.x0 - m_pixelBounds.x0, y - m_pixelBounds.y0);
        tile.image.pixels.insert(tile.image.pixels.end(), row, row + bounds.width());
    }
    return tile;
}

} // namespace strobe
