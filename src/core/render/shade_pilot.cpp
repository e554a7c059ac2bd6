#include "core/render/shade_pilot.h"

#include "core/math/hash.h"
#include "core/render/tile_renderer.h"

namespace strobe {

namespace {

/// Requests a shade for every hit and discards the radiance.
class PilotWorker : public IntegratorWorker {
  public:
    explicit PilotWorker(const Scene& scene) : m_scene(scene) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        for (const VisibilitySample& sample : batch.samples)
            if (sample.hit)
                requests.push_back(requestFor(m_scene, batch, sample));
    }
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb>,
                                 std::span<Rgb> values) override {
        std::fill(values.begin(), values.end(), Rgb(0));
        return values;
    }

  private:
    const Scene& m_scene;
};

class StatePilotRenderer : public PilotRenderer {
  public:
    StatePilotRenderer(const Scene& scene, IntegratorState& state, const Shader& shader,
                       const Sampler& sampler, const Filter& filter, int samplesPerPixel)
        : m_settings(settingsFor(samplesPerPixel)),
          m_renderer(scene, state, shader, sampler, filter, m_settings, SampleDependence::None) {
        constexpr uint32_t kBatchSamples = 512; // a pilot is short: larger buffers cost more page faults
        m_renderer.limitBatches(kBatchSamples);
    }
    Counters render(Film& film, std::span<const V2i> pixels, uint64_t seed) override {
        m_settings.seed = seed;
        m_renderer.renderPixels(pixels, film);
        return m_renderer.takeCounters();
    }

  private:
    static RenderSettings settingsFor(int samplesPerPixel) {
        RenderSettings settings;
        settings.samplesPerPixel = samplesPerPixel;
        return settings;
    }
    RenderSettings m_settings;
    TileRenderer m_renderer; // reads the seed of each tile from m_settings
};

} // namespace

ShadeCost measureShadeCost(const Scene& scene, const Shader& shader, const Sampler& sampler,
                           const Filter& filter, const RenderSettings& settings,
                           const PixelBounds& pixelBounds) {
    constexpr int kPixels = 16;
    RenderSettings pilotSettings;
    pilotSettings.seed = settings.seed;
    pilotSettings.samplesPerPixel = 16;
    UnsharedState<PilotWorker> pilot(scene);
    TileRenderer renderer(scene, pilot, shader, sampler, filter, pilotSettings, SampleDependence::None);
    renderer.timeShadesEvery(1);
    for (int i = 0; i < kPixels; ++i) {
        const uint64_t h = hashOf(settings.seed, i);
        const int x = pixelBounds.x0 + int(h % uint64_t(pixelBounds.width()));
        const int y = pixelBounds.y0 + int((h >> 32) % uint64_t(pixelBounds.height()));
        const PixelBounds pixel{x, y, x + 1, y + 1};
        Film film(pixel.x1, pixel.y1, pixel);
        renderer.renderTile(pixel, film);
    }
    ShadeCost total;
    for (const ShadeCost& cost : renderer.counters().shadeCosts)
        total.add(cost);
    return total;
}

std::unique_ptr<PilotRenderer> makePilotRenderer(const Scene& scene, IntegratorState& state,
                                                 const Shader& shader, const Sampler& sampler,
                                                 const Filter& filter, int samplesPerPixel) {
    return std::make_unique<StatePilotRenderer>(scene, state, shader, sampler, filter, samplesPerPixel);
}

} // namespace strobe
