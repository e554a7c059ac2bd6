// The render loop: tiles, distributed over threads.
#pragma once

#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/render/render_settings.h"
#include "core/render/shader.h"

namespace STROBE_API strobe {

class TileRenderer;

/// Renders one or more passes over the same pixels. Before each further pass, call `restart` for an
/// independent set of samples, or `setSlice` for another slice of the same set.
class Renderer {
  public:
    /// All arguments but `settings` and `pixelBounds` must outlive the renderer.
    Renderer(const Scene& scene, const Integrator& integrator, const Shader& shader, const Sampler& sampler,
             const Filter& filter, const RenderSettings& settings, const PixelBounds& pixelBounds);
    ~Renderer();

    /// Renders a pass into the film. Returns false if settings.stop ended it early. Throws Error if the
    /// number of samples or the slice is invalid, if there is a slice and the integrator has
    /// SampleDependence::Render, or if the integrator decides otherwise (IntegratorState::note) than for the
    /// samples that the film has.
    bool render(Film& film);
    /// Makes the next `render` an independent one with this seed, of all samples. `samplesBefore`: see
    /// RenderSettings.
    void restart(uint64_t seed, int samplesPerPixel, uint64_t samplesBefore = 0);
    /// Makes the next `render` render this slice of the same samples.
    void setSlice(const SampleSlice& slice);

    /// Completes a film that holds all samples rendered so far: see IntegratorState::finish.
    void finish(Film& film, std::vector<float>* errors = nullptr);

    /// The statistics of all passes so far.
    const RenderStats& stats() const { return m_stats; }

  private:
    void setNote(Film& film) const;
    /// Returns the pixels of the tile to render. With settings.resume: those that lack samples; the samples
    /// that these have are removed.
    std::vector<PixelBounds> missingIn(const PixelBounds& tile, Film& film) const;
    bool renderTile(const PixelBounds& tile, TileRenderer& renderer, Film& film) const;
    bool renderTiles(const std::vector<PixelBounds>& tiles, int threads, Film& film);
    void addCounters(size_t thread, Counters counters);
    RenderContext makeContext(int threads, const Film& film) const;

    const Scene& m_scene;
    const Integrator& m_integrator;
    const Shader& m_shader;
    const Sampler& m_sampler;
    const Filter& m_filter;
    RenderSettings m_settings;
    const PixelBounds m_pixelBounds;
    std::unique_ptr<IntegratorState> m_state; ///< created by the first `render`
    RenderStats m_stats;
};

/// Renders the film's pixels in one pass. A pixel depends on the scene, the integrator, the shader, the
/// sampler, the filter, the seed and its coordinates, but not on the film's pixel bounds, tiles or threads;
/// with SampleDependence::Render it may depend on them.
RenderStats render(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings, Film& film);

} // namespace strobe
