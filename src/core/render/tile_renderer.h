// What one thread of a render does: the five steps of each batch of pixels.
#pragma once

#include "core/render/integrator.h"
#include "core/render/render_settings.h"
#include "core/render/shader.h"

namespace strobe {

/// Everything one thread needs; buffers are reused from batch to batch.
class TileRenderer {
  public:
    TileRenderer(const Scene& scene, IntegratorState& integrator, const Shader& shader,
                 const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                 SampleDependence dependence);

    /// False: settings.stop said so before its end.
    bool renderTile(const PixelBounds& tile, Film& film);
    /// Shades packet by packet, each of one material and timed, in every `interval`-th batch and some early
    /// ones.
    void meterEvery(uint32_t interval) { m_meterInterval = interval; }
    /// Completes the counters.
    void finish() { m_integrator->report(m_counters); }
    const Counters& counters() const { return m_counters; }

  private:
    void initializeLayout();
    void renderBatch(Film& film);
    void generate();
    void generate(uint32_t first, int n, VisibilitySoA& out);
    void trace();
    void shade();
    void shadeMetered();
    size_t costSlot(const Hit& hit) const;
    void clampValues();
    std::span<const Rgb> dimmed(std::span<const Rgb> values, std::span<Rgb> room) const;
    void accumulate(Film& film);
    void addOneByOne(PixelAccumulator& sum, uint32_t first, uint32_t n);
    void accumulateComponent(int component, std::span<const Rgb> values);
    void describe(Film& film);
    void probe();
    void recordInvalidSample(const PixelRef& pixel, uint32_t sample);

    const Scene& m_scene;
    const bool m_moves; ///< else time is not sampled
    const Sampler& m_sampler;
    const Filter& m_filter;
    const RenderSettings& m_settings;
    const SampleSlice m_wanted; ///< of each pixel's samples: what goes into the film
    const SampleSlice m_slice;  ///< what is traced: also those that the wanted ones depend on
    const uint32_t m_pixelsPerBatch;
    std::unique_ptr<IntegratorWorker> m_integrator;
    std::unique_ptr<ShaderWorker> m_shader;
    const size_t m_components; ///< that radiance is split into
    Counters m_counters;
    uint32_t m_meterInterval = 256, m_batches = 0;

    std::vector<PixelRef> m_pixels;
    SoAVector<VisibilitySoA> m_samples;
    std::vector<SampleRange> m_ranges;
    ShadingRequests m_requests;
    std::vector<Rgb> m_shaded;     ///< by request; then, part by component, the same
    std::span<const Rgb> m_values; ///< by sample: somewhere in m_shaded or in m_resolved
    std::vector<Rgb> m_resolved, m_componentRoom;
    std::vector<float> m_dimming; ///< by sample, of settings.clamp; empty without
    RayPacket m_block;
    // For metering and layers:
    std::vector<uint32_t> m_order, m_slots;
    ShadingRequests m_packet;
    struct PixelTally {
        uint32_t shades = 0, asked = 0, hits = 0;
        double time = 0;
    };
    std::vector<PixelTally> m_tallies;
};

} // namespace strobe
