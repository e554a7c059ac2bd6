#include "display/live_film.h"

namespace strobe {

namespace {

constexpr int kPiece = 64; ///< pixels along a side

int piecesOf(int pixels) { return (pixels + kPiece - 1) / kPiece; }

} // namespace

LiveFilm::LiveFilm(const Film& like)
    : m_pixelBounds(like.pixelBounds()),
      m_film(like.fullWidth(), like.fullHeight(), like.pixelBounds(), like.layers()),
      m_across(piecesOf(m_pixelBounds.width())), m_down(piecesOf(m_pixelBounds.height())),
      m_filled(size_t(m_across) * size_t(m_down)), m_waits(m_filled.size()) {
    if (!like.sums().empty())
        m_film.enableAccumulation();
}

void LiveFilm::update(const Film& film, const PixelBounds& tile) {
    {
        const std::lock_guard lock(m_mutex);
        m_film.copyFrom(film, tile);
        touch(tile);
    }
    m_changed.notify_one();
}

void LiveFilm::touch(const PixelBounds& tile) {
    for (int j = (tile.y0 - m_pixelBounds.y0) / kPiece; j <= (tile.y1 - 1 - m_pixelBounds.y0) / kPiece; ++j)
        for (int i = (tile.x0 - m_pixelBounds.x0) / kPiece; i <= (tile.x1 - 1 - m_pixelBounds.x0) / kPiece;
             ++i) {
            const int piece = j * m_across + i;
            m_filled[size_t(piece)] = true;
            if (m_waits[size_t(piece)])
                continue;
            m_waits[size_t(piece)] = true;
            m_queue.push_back(piece);
        }
}

void LiveFilm::touchAll() {
    const std::lock_guard lock(m_mutex);
    for (size_t i = 0; i < m_filled.size(); ++i)
        if (m_filled[i] && !m_waits[i]) {
            m_waits[i] = true;
            m_queue.push_back(int(i));
        }
}

Film LiveFilm::film() const {
    const std::lock_guard lock(m_mutex);
    return m_film;
}

std::optional<LiveFilm::Piece> LiveFilm::nextChanged(std::chrono::milliseconds patience) {
    std::unique_lock lock(m_mutex);
    if (!m_changed.wait_for(lock, patience, [&] { return m_head < m_queue.size(); }))
        return {};
    const int piece = m_queue[m_head++];
    if (m_head == m_queue.size() || m_head > m_filled.size()) {
        m_queue.erase(m_queue.begin(), m_queue.begin() + ptrdiff_t(m_head));
        m_head = 0;
    }
    m_waits[size_t(piece)] = false;
    const int x = m_pixelBounds.x0 + piece % m_across * kPiece,
              y = m_pixelBounds.y0 + piece / m_across * kPiece;
    const PixelBounds w{x, y, std::min(x + kPiece, m_pixelBounds.x1), std::min(y + kPiece, m_pixelBounds.y1)};
    Piece out{w, {w.width(), w.height(), {}}};
    for (int row = w.y0; row < w.y1; ++row) {
        const Rgb* from = &m_film.image().at(w.x0 - m_pixelBounds.x0, row - m_pixelBounds.y0);
        out.image.pixels.insert(out.image.pixels.end(), from, from + w.width());
    }
    return out;
}

} // namespace strobe
