// The render loop: tiles over threads, five steps per batch of pixels.
#pragma once

#include "core/render/integrator.h"
#include "core/render/render_settings.h"
#include "core/render/shader.h"

namespace strobe {

/// A render that may take several passes over its window, each of other samples.
class Renderer {
  public:
    /// What is passed in outlives the renderer.
    Renderer(const Scene& scene, const Integrator& integrator, const Shader& shader, const Sampler& sampler,
             const Filter& filter, const RenderSettings& settings, const PixelBounds& pixelBounds);
    ~Renderer();

    /// The whole window, or what there is of it when settings.stop says so: then false. Throws Error for a
    /// slice of samples that depend on more than their pixel.
    bool render(Film& film);
    /// From now on this is a render with another seed and other samples per pixel: all of them are to be
    /// rendered, and none of them depends on what came before.
    void restart(uint64_t seed, int samplesPerPixel);
    /// From now on, the next `render` is to render this slice of the same samples.
    void continueWith(const SampleSlice& slice);

    /// Of all passes.
    const RenderStats& stats() const { return m_stats; }

  private:
    /// Whether the film has it already; what it has of it in part is taken away.
    bool isThere(const PixelBounds& tile, Film& film) const;
    bool renderTiles(const std::vector<PixelBounds>& tiles, int threads, Film& film);
    void addCounters(size_t thread, Counters counters);
    RenderContext context(int threads) const;

    const Scene& m_scene;
    const Integrator& m_integrator;
    const Shader& m_shader;
    const Sampler& m_sampler;
    const Filter& m_filter;
    RenderSettings m_settings;
    const PixelBounds m_pixelBounds;
    std::unique_ptr<IntegratorState> m_shared;
    RenderStats m_stats;
};

/// Renders the film's window. A pixel is a function of scene, shader, integrator, sampler, filter, seed and
/// its own coordinates: not of window, tiles or threads.
RenderStats render(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings, Film& film);

} // namespace strobe
