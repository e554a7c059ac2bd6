// The render loop: tiles over threads, five steps per batch of pixels.
#pragma once

#include "core/film/film.h"
#include "core/render/aov_film.h"
#include "core/render/integrator.h"
#include "core/render/light_film.h"

#include <functional>
#include <optional>

namespace strobe {

/// What became of one visibility sample.
struct SampleRecord {
    int x, y;        ///< pixel
    uint32_t number; ///< in its pixel
    const VisibilitySample& sample;
    Rgb value;      ///< radiance, filter weight not included
    uint64_t block; ///< see IntegratorWorker::sharingId
    uint32_t asked; ///< shades that were made because of it
};

struct RenderSettings {
    int samplesPerPixel = 1;
    /// Of each pixel's samples, those to render: sums of slices add up to the whole's, to the bit. None: all.
    std::optional<SampleSlice> slice;
    /// The film keeps sums, and pixels that have all these samples already: tiles of them are left as they
    /// are; others are begun anew.
    bool resume = false;
    uint64_t seed = 0;
    /// Samples of which a channel is more become darker, so that it is this. Biased; 0: none do. (Those that
    /// are not finite stay what they are.)
    float clamp = 0;
    int threads = 0;   ///< 0: as many as the machine has
    int tileSize = 32; ///< pixels; changes the time, never a pixel
    /// Called now and then, from any thread but one at a time, with the fraction done.
    std::function<void(double)> progress;
    /// Called for every sample, from any thread: to look into pixels. Leave empty otherwise.
    std::function<void(const SampleRecord&)> probe;
    /// Called from any thread when a tile is in the film; no other thread writes there.
    std::function<void(const Film&, const PixelBounds&)> tileDone;
    /// Asked from any thread, about a thousand samples apart; once true, the rest is left out.
    std::function<bool()> stop;
    /// Gathers what samples see, over the film's window; null: nothing does.
    AovFilm* features = nullptr;
    /// Takes parts of the radiance, over the film's window; null: it is not split.
    LightFilm* lights = nullptr;
    LightComponents split() const { return lights ? lights->split() : LightComponents{}; }
};

struct RenderStats {
    Counters total;
    std::vector<Counters> threads;
    double seconds = 0; ///< wall clock
    int passes = 0;     ///< over the whole window
    uint64_t samplesPerPixel = 0;
    std::optional<double> noise; ///< NoiseEstimate::level, where it was asked for
};

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
