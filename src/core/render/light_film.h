// Layers of light: direct and indirect, and by groups of lights. Together they are the picture.
#pragma once

#include "core/film/aov.h"
#include "core/film/pixel_accumulator.h"
#include "core/render/integrator.h"

namespace strobe {

/// Gathers parts of the light over a window of the frame.
class LightFilm {
  public:
    /// `groups`: the names that the groups of the scene's lights go by. A group's layer is "light_" and its
    /// name.
    LightFilm(const PixelBounds& pixelBounds, std::vector<Aov> layers, std::vector<std::string> groups);

    const LightComponents& components() const { return m_components; }
    /// Adds samples' values of a part (see LightComponents::components) to a pixel. Different pixels may be
    /// written by different threads.
    void add(int component, int x, int y, const PixelAccumulator& sum) {
        m_sums[size_t(component)]
              [size_t(y - m_pixelBounds.y0) * size_t(m_pixelBounds.width()) + size_t(x - m_pixelBounds.x0)]
                  .add(sum);
    }
    /// Row by row over the window, of what was added so far.
    std::vector<AovChannel> channels() const;

  private:
    bool has(Aov layer) const;
    void append(const std::string& layer, size_t component, std::vector<AovChannel>& out) const;

    const PixelBounds m_pixelBounds;
    const std::vector<Aov> m_layers;
    const std::vector<std::string> m_groups;
    LightComponents m_components;
    std::vector<std::vector<PixelAccumulator>> m_sums; ///< by part
};

} // namespace strobe
