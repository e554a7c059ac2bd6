// AOVs of AovGroup::Light: direct and indirect light, and the light of each group.
#pragma once

#include "core/film/aov_sums.h"
#include "core/math/api.h"
#include "core/render/integrator.h"

namespace STROBE_API strobe {

/// Accumulates the components of radiance per pixel. Direct and indirect light add up to the image, and so do
/// the light groups. Sums are exact, as in Film.
class LightFilm {
  public:
    /// `groups`: the names of the scene's light groups. The layer of a group is named "light_" + group.
    LightFilm(const PixelBounds& pixelBounds, std::vector<Aov> layers, std::vector<std::string> groups);

    const std::vector<Aov>& layers() const { return m_layers; }
    const std::vector<std::string>& groups() const { return m_groups; }
    const LightComponents& components() const { return m_components; }
    /// Adds samples of one component (0 <= component < LightComponents::count) to a pixel. Threads may
    /// concurrently add to different pixels.
    void add(int component, int x, int y, const PixelAccumulator& sum) {
        m_sums[size_t(component)][index(x, y)].add(sum);
    }
    /// Returns the means of the samples added so far, row by row over the pixel bounds.
    std::vector<AovChannel> channels() const;

    /// Appends the samples of the pixels in `tile`, which lies within the pixel bounds, to `bytes`.
    void store(const PixelBounds& tile, std::string& bytes) const;
    /// Removes what `store` appended from the front of `bytes`, and adds these samples. Returns false if the
    /// bytes are damaged.
    bool load(const PixelBounds& tile, std::string_view& bytes);

  private:
    size_t index(int x, int y) const {
        return size_t(y - m_pixelBounds.y0) * size_t(m_pixelBounds.width()) + size_t(x - m_pixelBounds.x0);
    }
    bool has(Aov layer) const;
    void appendChannels(const std::string& layer, size_t component, std::vector<AovChannel>& out) const;

    PixelBounds m_pixelBounds;
    std::vector<Aov> m_layers;
    std::vector<std::string> m_groups;
    LightComponents m_components;
    std::vector<std::vector<PixelAccumulator>> m_sums; ///< per component and pixel
};

} // namespace strobe
