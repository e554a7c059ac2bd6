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

void FrameLight::add(std::span<const PixelUse> uses, const TileSums& tile) {
    TileSums copy = tile; // its vectors have no unused memory
    const std::lock_guard lock(m_mutex);
    copy.uses = copyUses(uses, m_arena);
    m_tiles.push_back(std::move(copy));
}

RecordedLight FrameLight::take(const Film& film) {
    if (!m_light)
        return RecordedLight(film);
    RecordedLight light = std::move(*m_light);
    m_light.reset();
    m_arena = {};
    light.join(std::exchange(m_tiles, {}));
    return light;
}

} // namespace strobe
