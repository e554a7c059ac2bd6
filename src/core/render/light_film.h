// AOVs of AovGroup::Light: direct and indirect light, and the light of each group.
#pragma once

#include "core/film/aov.h"
#include "core/film/pixel_accumulator.h"
#include "core/render/integrator.h"

namespace strobe {

/// Accumulates the components of radiance per pixel. Direct and indirect light add up to the image, and so do
/// the light groups. Sums are exact, as in Film.
class LightFilm {
  public:
    /// `groups`: the names of the scene's light groups. The layer of a group is named "light_" + group.
    LightFilm(const PixelBounds& pixelBounds, std::vector<Aov> layers, std::vector<std::string> groups);

    const LightComponents& components() const { return m_components; }
    /// Adds samples of one component (0 <= component < LightComponents::count) to a pixel. Threads may
    /// concurrently add to different pixels.
    void add(int component, int x, int y, const PixelAccumulator& sum) {
        m_sums[size_t(component)]
              [size_t(y - m_pixelBounds.y0) * size_t(m_pixelBounds.width()) + size_t(x - m_pixelBounds.x0)]
                  .add(sum);
    }
    /// Returns the means of the samples added so far, row by row over the pixel bounds.
    std::vector<AovChannel> channels() const;

  private:
    bool has(Aov layer) const;
    void appendChannels(const std::string& layer, size_t component, std::vector<AovChannel>& out) const;

    const PixelBounds m_pixelBounds;
    const std::vector<Aov> m_layers;
    const std::vector<std::string> m_groups;
    LightComponents m_components;
    std::vector<std::vector<PixelAccumulator>> m_sums; ///< per component and pixel
};

} // namespace strobe
