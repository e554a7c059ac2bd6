#include "core/render.h"

#include "core/hash.h"
#include "core/tile_renderer.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <mutex>
#include <stdexcept>

namespace strobe {

namespace {

std::vector<Window> tilesOf(const Window& window, int size) {
    std::vector<Window> tiles;
    for (int y = window.y0; y < window.y1; y += size)
        for (int x = window.x0; x < window.x1; x += size)
            tiles.push_back({x, y, std::min(x + size, window.x1), std::min(y + size, window.y1)});
    return tiles;
}

/// Every sample for itself, to see what a shade costs.
class PilotWorker : public IntegratorWorker {
  public:
    explicit PilotWorker(const Scene& scene) : m_scene(scene) {}
    void plan(const VisibilityBatch& batch, std::vector<ShadingRequest>& requests) override {
        for (const VisibilitySample& sample : batch.samples)
            if (sample.hit)
                requests.push_back(requestFor(m_scene, batch, sample));
    }
    void resolve(const VisibilityBatch&, std::span<const Rgb>, std::span<Rgb> values) override {
        std::fill(values.begin(), values.end(), Rgb(0));
    }

  private:
    const Scene& m_scene;
};

/// The cost of shading what a few pixels of the window see.
ShadeCost measureShadeCost(const Scene& scene, const Shader& shader, const Sampler& sampler,
                           const Filter& filter, RenderSettings settings, const Window& window) {
    constexpr int kPixels = 16;
    settings.samplesPerPixel = 16;
    settings.probe = nullptr;
    UnsharedRender<PilotWorker> pilot(scene);
    TileRenderer renderer(scene, pilot, shader, sampler, filter, settings);
    renderer.meterEvery(1);
    for (int i = 0; i < kPixels; ++i) {
        const uint64_t h = hashOf(settings.seed, i);
        const int x = window.x0 + int(h % uint64_t(window.width()));
        const int y = window.y0 + int((h >> 32) % uint64_t(window.height()));
        const Window pixel{x, y, x + 1, y + 1};
        Film film(pixel.x1, pixel.y1, pixel);
        renderer.renderTile(pixel, film);
    }
    ShadeCost cost;
    for (const ShadeCost& c : renderer.counters().shadeCosts)
        cost.add(c);
    return cost;
}

} // namespace

RenderStats render(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings, Film& film) {
    const auto start = std::chrono::steady_clock::now();
    const int threads = settings.threads > 0 ? settings.threads : tbb::info::default_concurrency();
    const RenderContext context{
        settings.seed, threads, settings.samplesPerPixel, film.window(), shader.hasIndirectLight(), [&] {
            return measureShadeCost(scene, shader, sampler, filter, settings, film.window());
        }};
    const std::unique_ptr<IntegratorRender> shared = integrator.begin(scene, context);
    const std::vector<Window> tiles = tilesOf(film.window(), std::clamp(settings.tileSize, 1, 1 << 16));
    tbb::enumerable_thread_specific<std::unique_ptr<TileRenderer>> renderers;
    // TBB orders what is before, in and after its tasks. These two say so in the language, too:
    // ThreadSanitizer does not see into TBB.
    std::atomic<bool> begun{false};
    std::atomic<size_t> done{0};
    std::mutex progressMutex;

    // TBB offers no more workers than cores unless asked.
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      size_t(std::max(threads, 1)));
    tbb::task_arena arena(threads);
    begun.store(true, std::memory_order_release);
    arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<size_t>(0, tiles.size(), 1),
            [&](const tbb::blocked_range<size_t>& range) {
                if (!begun.load(std::memory_order_acquire))
                    return;
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
    if (done.load(std::memory_order_acquire) != tiles.size())
        throw std::logic_error("tiles were left out");
    for (const auto& renderer : renderers) {
        renderer->finish();
        stats.threads.push_back(renderer->counters());
        stats.total.add(renderer->counters());
    }
    stats.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return stats;
}

} // namespace strobe
