// Rendering of tiles on one thread: the five steps of each batch of pixels.
#pragma once

#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/render/render_settings.h"
#include "core/render/sharing_aovs.h"
#include "core/render/timed_shader.h"
#include "core/render/visibility_tracer.h"

namespace STROBE_API strobe {

/// The state of one render thread. Buffers are reused from batch to batch.
class TileRenderer {
  public:
    /// All arguments but `dependence` must outlive this object.
    TileRenderer(const Scene& scene, IntegratorState& integrator, const Shader& shader,
                 const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                 SampleDependence dependence);

    /// Renders the pixels of a tile. Returns false if settings.stop ended it early.
    bool renderTile(const PixelBounds& tile, Film& film);
    /// Renders some pixels of a film as one tile, without SampleFactors and settings.stop.
    void renderPixels(std::span<const V2i> pixels, Film& film);
    /// Sets the largest number of samples of a batch. Call it before the first tile.
    void limitBatches(uint32_t samples) { m_batchSamples = samples; }
    /// See TimedShader::timeEvery.
    void timeShadesEvery(uint32_t interval) { m_shader.timeEvery(interval); }
    /// Completes the counters. Call it once, after the last tile.
    void finish() { m_integrator->report(m_counters); }
    const Counters& counters() const { return m_counters; }
    /// Returns the counters, without those of the integrator's worker, and sets them to 0.
    Counters takeCounters();

  private:
    /// How the pixels of a batch are sampled, and the samples of the last one.
    struct Sampling {
        uint32_t factor; ///< see SampleFactors
        uint32_t samplesPerPixel;
        SampleSlice filmSlice;   ///< the samples of each pixel that are added to the film
        SampleSlice tracedSlice; ///< these and the samples that their values depend on
        uint32_t pixelsPerBatch;
        VisibilityTracer tracer;
        SoAVector<VisibilitySoA> samples;
    };
    Sampling& samplingFor(uint32_t factor);
    bool renderPixelsOf(const PixelBounds& tile, uint32_t factor, Film& film);
    void renderBatch(Film& film);
    void shade();
    void resolve(const VisibilityBatch& batch);
    void accumulateComponents(const VisibilityBatch& batch, StageClock& clock);
    void writeAovs(const VisibilityBatch& batch, Film& film);
    void clampValues();
    std::span<const Rgb> applyClamp(std::span<const Rgb> values, std::span<Rgb> clamped) const;
    uint32_t firstFilmSample(uint32_t pixel) const;
    const SoAVector<VisibilitySoA>& samples() const { return m_sampling->samples; }
    void accumulate(Film& film);
    void addOneByOne(PixelAccumulator& sum, uint32_t first, uint32_t n);
    void accumulateComponent(int component, std::span<const Rgb> values);
    void recordInvalidSample(const PixelRef& pixel, uint32_t sample);

    const RenderSettings& m_settings;
    const Scene& m_scene;
    const Sampler& m_sampler;
    const Filter& m_filter;
    const SampleDependence m_dependence;
    const SampleFactors* const m_factors; ///< IntegratorState::sampleFactors
    const bool m_observes;                ///< IntegratorState::observes
    const size_t m_components;            ///< LightComponents::count
    uint32_t m_batchSamples = 2048;       ///< all buffers of such a batch fit into a second-level cache
    std::unique_ptr<IntegratorWorker> m_integrator;
    TimedShader m_shader;
    SharingAovs m_sharingAovs;
    Counters m_counters;

    // The current batch:
    std::vector<PixelRef> m_pixels;
    Sampling* m_sampling = nullptr;
    ShadingRequests m_requests;
    std::vector<Rgb> m_shaded;                ///< per request: the radiance, then component by component
    std::vector<FirstVertex> m_firstVertices; ///< per request; empty unless m_observes
    std::span<const Rgb> m_values;            ///< per sample: its radiance, in m_shaded or m_resolved
    std::vector<float> m_clampScales;         ///< per sample; only if settings.clamp > 0
    // Buffers:
    std::vector<std::unique_ptr<Sampling>> m_samplings; ///< in order of their first use
    std::vector<Rgb> m_resolved, m_componentValues;
};

} // namespace strobe
