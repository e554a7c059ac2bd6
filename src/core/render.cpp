#include "core/render.h"

#include "core/hash.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <mutex>

namespace strobe {

ShadingRequest requestFor(const Scene& scene, const VisibilityBatch& batch, const VisibilitySample& sample) {
    ShadingRequest request;
    request.hit = sample.hit;
    request.ray = sample.ray;
    request.cone = scene.needsFootprint() ? scene.camera().cone(sample.film) : RayCone{};
    request.domain = batch.pixels[sample.pixel].domain;
    request.index = sample.index;
    request.total = batch.samplesPerPixel;
    return request;
}

namespace {

// Dimensions of the camera sample; shading's begin beyond.
enum : uint32_t { kDimFilm = 0, kDimLens = 1, kDimTime = 2 };

/// About as many samples as keep all buffers of a batch in the second-level cache.
constexpr uint32_t kBatchSamples = 512;

/// Everything one thread needs; buffers are reused from batch to batch.
class TileRenderer {
  public:
    TileRenderer(const Scene& scene, IntegratorRender& integrator, const Shader& shader,
                 const Sampler& sampler, const Filter& filter, const RenderSettings& settings)
        : m_scene(scene), m_sampler(sampler), m_filter(filter), m_settings(settings),
          m_integrator(integrator.makeWorker()), m_shader(shader.makeWorker(scene, sampler)) {}

    void renderTile(const Window& tile, Film& film) {
        const FastFloats fast;
        const uint32_t spp = uint32_t(m_settings.samplesPerPixel);
        const uint32_t pixelsPerBatch = std::max(1u, kBatchSamples / spp);
        m_pixels.clear();
        for (int y = tile.y0; y < tile.y1; ++y)
            for (int x = tile.x0; x < tile.x1; ++x) {
                m_pixels.push_back({x, y, hashOf(m_settings.seed, x, y)});
                if (m_pixels.size() == pixelsPerBatch)
                    renderBatch(film);
            }
        if (!m_pixels.empty())
            renderBatch(film);
    }

    void finish() { m_integrator->report(m_counters); }
    const Counters& counters() const { return m_counters; }

  private:
    void renderBatch(Film& film) {
        StageClock clock(m_counters);
        generate();
        clock.charge(Stage::Generate);
        trace();
        clock.charge(Stage::Trace);
        const VisibilityBatch batch{m_pixels, m_samples, uint32_t(m_settings.samplesPerPixel)};
        m_requests.clear();
        m_integrator->plan(batch, m_requests);
        clock.charge(Stage::Plan);
        m_shaded.resize(m_requests.size());
        m_shader->shade(m_requests, m_shaded, m_counters);
        clock.charge(Stage::Shade);
        m_values.resize(m_samples.size());
        m_integrator->resolve(batch, m_shaded, m_values);
        develop(film);
        clock.charge(Stage::Resolve);
        m_counters.pixels += m_pixels.size();
        m_counters.visibilitySamples += m_samples.size();
        m_pixels.clear();
    }

    void generate() {
        const uint32_t spp = uint32_t(m_settings.samplesPerPixel);
        const bool lens = m_scene.camera().hasLens();
        m_film.resize(spp), m_lens.resize(spp, V2f(0)), m_time.resize(spp), m_weights.resize(spp);
        m_cameraSamples.resize(spp);
        m_rays.resize(spp);
        m_samples.resize(m_pixels.size() * spp);
        for (uint32_t p = 0; p < m_pixels.size(); ++p) {
            const PixelRef& pixel = m_pixels[p];
            const SampleRange range{pixel.domain, 0, spp, spp};
            m_sampler.fill2D(range, kDimFilm, m_film.data());
            m_sampler.fill1D(range, kDimTime, m_time.data());
            if (lens)
                m_sampler.fill2D(range, kDimLens, m_lens.data());
            for (uint32_t i = 0; i < spp; ++i) {
                const Filter::Sample f = m_filter.sample(m_film[i]);
                m_weights[i] = f.weight;
                m_cameraSamples[i] = {V2f(float(pixel.x) + 0.5f, float(pixel.y) + 0.5f) + f.offset, m_lens[i],
                                      m_time[i]};
            }
            m_scene.camera().rays(m_cameraSamples.data(), int(spp), m_rays.data());
            for (uint32_t i = 0; i < spp; ++i)
                m_samples[p * spp + i] = {Hit{}, m_rays[i], m_cameraSamples[i].film, m_weights[i], p, i};
        }
    }

    void trace() {
        const Tracer& tracer = m_scene.tracer();
        for (size_t first = 0; first < m_samples.size(); first += RayBlock::kSize) {
            const int n = int(std::min<size_t>(RayBlock::kSize, m_samples.size() - first));
            for (int i = 0; i < n; ++i) {
                const Ray& ray = m_samples[first + i].ray;
                m_block.set(i, ray.o, ray.d, ray.tmin, kInfinity, ray.time);
            }
            tracer.intersect(m_block, n, true);
            for (int i = 0; i < n; ++i)
                m_samples[first + i].hit = tracer.hit(m_block, i);
        }
    }

    /// Pixel means, in double and in sample order, over the samples that are numbers.
    void develop(Film& film) {
        const uint32_t spp = uint32_t(m_settings.samplesPerPixel);
        for (uint32_t p = 0; p < m_pixels.size(); ++p) {
            double r = 0, g = 0, b = 0;
            uint32_t good = 0;
            for (uint32_t i = p * spp; i < (p + 1) * spp; ++i) {
                const Rgb& value = m_values[i];
                if (m_settings.probe)
                    m_settings.probe(m_pixels[p].x, m_pixels[p].y, i - p * spp, value);
                if (!isFinite(value)) {
                    noteBad(m_pixels[p], i - p * spp);
                    continue;
                }
                const double w = m_samples[i].weight;
                r += w * value.x, g += w * value.y, b += w * value.z;
                ++good;
            }
            const double scale = good ? 1.0 / good : 0;
            film.set(m_pixels[p].x, m_pixels[p].y, Rgb(float(r * scale), float(g * scale), float(b * scale)));
        }
    }

    void noteBad(const PixelRef& pixel, uint32_t sample) {
        ++m_counters.badSamples;
        if (m_counters.firstBad.size() < 16)
            m_counters.firstBad.push_back({pixel.x, pixel.y, sample});
    }

    const Scene& m_scene;
    const Sampler& m_sampler;
    const Filter& m_filter;
    const RenderSettings& m_settings;
    std::unique_ptr<IntegratorWorker> m_integrator;
    std::unique_ptr<ShaderWorker> m_shader;
    Counters m_counters;

    std::vector<PixelRef> m_pixels;
    std::vector<VisibilitySample> m_samples;
    std::vector<float> m_weights, m_time;
    std::vector<V2f> m_film, m_lens;
    std::vector<CameraSample> m_cameraSamples;
    std::vector<Ray> m_rays;
    std::vector<ShadingRequest> m_requests;
    std::vector<Rgb> m_shaded, m_values;
    RayBlock m_block;
};

std::vector<Window> tilesOf(const Window& window, int size) {
    std::vector<Window> tiles;
    for (int y = window.y0; y < window.y1; y += size)
        for (int x = window.x0; x < window.x1; x += size)
            tiles.push_back({x, y, std::min(x + size, window.x1), std::min(y + size, window.y1)});
    return tiles;
}

} // namespace

RenderStats render(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings, Film& film) {
    const auto start = std::chrono::steady_clock::now();
    const std::unique_ptr<IntegratorRender> shared = integrator.begin(scene, settings.seed);
    const std::vector<Window> tiles = tilesOf(film.window(), std::clamp(settings.tileSize, 1, 1 << 16));
    tbb::enumerable_thread_specific<std::unique_ptr<TileRenderer>> renderers;
    std::atomic<size_t> done{0};
    std::mutex progressMutex;

    const int threads = settings.threads > 0 ? settings.threads : tbb::info::default_concurrency();
    // TBB offers no more workers than cores unless asked.
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      size_t(std::max(threads, 1)));
    tbb::task_arena arena(threads);
    arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<size_t>(0, tiles.size(), 1),
            [&](const tbb::blocked_range<size_t>& range) {
                for (size_t i = range.begin(); i < range.end(); ++i) {
                    auto& renderer = renderers.local();
                    if (!renderer)
                        renderer =
                            std::make_unique<TileRenderer>(scene, *shared, shader, sampler, filter, settings);
                    renderer->renderTile(tiles[i], film);
                    const size_t finished = ++done;
                    if (settings.progress) {
                        const std::lock_guard lock(progressMutex);
                        settings.progress(double(finished) / double(tiles.size()));
                    }
                }
            },
            tbb::simple_partitioner{});
    });

    RenderStats stats;
    for (const auto& renderer : renderers) {
        renderer->finish();
        stats.threads.push_back(renderer->counters());
        stats.total.add(renderer->counters());
    }
    stats.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return stats;
}

} // namespace strobe
