#include "sharing/frame_light.h"

#include <utility>

namespace strobe {

bool FrameLight::beginTile(const Film& film) {
    if (film.accumulates())
        return false;
    const std::lock_guard lock(m_mutex);
    if (!m_light)
        m_light.emplace(film.pixelBounds(), m_parts);
    return true;
}

void FrameLight::add(const std::vector<CellSums>& cells, const PixelLists& lists) {
    // Copies have no unused memory.
    TileSums tile{m_otherArena.copy(cells),
                  m_otherArena.copy(lists.counts),
                  m_useArena.copy(lists.uses),
                  lists.rare,
                  lists.emission,
                  lists.refined};
    const std::lock_guard lock(m_mutex);
    m_tiles.push_back(std::move(tile));
}

RecordedLight FrameLight::take(const Film& film) {
    if (!m_light)
        return RecordedLight(film);
    RecordedLight light = std::move(*m_light);
    m_light.reset();
    m_useArena.release();
    m_otherArena.release();
    light.join(std::exchange(m_tiles, {}));
    return light;
}

} // namespace strobe
