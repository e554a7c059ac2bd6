// The light of the frame that is being rendered.
#pragma once

#include "sharing/records/recorded_light.h"

#include <mutex>
#include <optional>

namespace strobe {

/// Collects the light of the tiles of a film. If the film accumulates, more samples may follow, and the
/// film's records contain the light. Otherwise the tiles are joined directly, which takes less time and
/// memory. All functions but `take` are thread-safe.
class FrameLight {
  public:
    explicit FrameLight(LightParts parts) : m_parts(parts) {}
    /// Prepares for a tile of the film. Returns false if the film's records contain its light.
    bool beginTile(const Film& film);
    // Precondition: beginTile returned true.
    size_t indexOf(int x, int y) const {
        const PixelBounds& bounds = m_light->pixelBounds;
        return size_t(y - bounds.y0) * size_t(bounds.width()) + size_t(x - bounds.x0);
    }
    /// See RecordedLight::setPixel.
    void setPixel(int x, int y, PixelLight& light, PixelLists& lists) {
        m_light->setPixel(indexOf(x, y), light, lists);
    }
    /// Adds a tile whose pixels are set.
    void add(const std::vector<CellSums>& cells, const PixelLists& lists);

    /// Returns the light of all tiles of the film. Removes the tiles that were added here.
    RecordedLight take(const Film& film);

  private:
    const LightParts m_parts;
    std::mutex m_mutex;
    std::optional<RecordedLight> m_light; ///< none until beginTile returns true
    std::vector<TileSums> m_tiles;
    ByteArena m_useArena;   ///< of the tiles' uses
    ByteArena m_otherArena; ///< of the tiles' cells and counts, which `take` frees
};

} // namespace strobe
