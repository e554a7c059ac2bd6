#include "core/render/render.h"

#include "core/math/hash.h"
#include "core/math/pixel_rectangles.h"
#include "core/render/shade_pilot.h"
#include "core/render/tile_renderer.h"
#include "core/util/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <mutex>
#include <stdexcept>

namespace strobe {

namespace {

/// Returns the tiles of disjoint rectangles.
std::vector<PixelBounds> tilesOf(const std::vector<PixelBounds>& regions, int size) {
    std::vector<PixelBounds> tiles;
    for (const PixelBounds& region : regions)
        for (int y = region.y0; y < region.y1; y += size)
            for (int x = region.x0; x < region.x1; x += size)
                tiles.push_back({x, y, std::min(x + size, region.x1), std::min(y + size, region.y1)});
    return tiles;
}

/// Throws Error if the number of samples or the slice is invalid.
void checkSamples(const RenderSettings& settings, SampleDependence dependence) {
    if (uint64_t(settings.samplesPerPixel) > PixelAccumulator::kMaxSamples)
        throw Error("more than " + std::to_string(PixelAccumulator::kMaxSamples) + " samples per pixel",
                    ErrorKind::Usage);
    if (dependence == SampleDependence::Render && (settings.slice || !settings.regions.empty()))
        throw Error("this integrator's samples depend on other pixels or on the order of rendering and "
                    "cannot be rendered in slices",
                    ErrorKind::Usage);
    if (!settings.slice)
        return;
    const SampleSlice& slice = *settings.slice;
    if (slice.first >= slice.end || slice.end > uint32_t(settings.samplesPerPixel))
        throw Error("samples " + std::to_string(slice.first) + ":" + std::to_string(slice.end) +
                        ": a pixel has " + std::to_string(settings.samplesPerPixel) + " samples",
                    ErrorKind::Usage);
}

double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int threadCount(const RenderSettings& settings) {
    return settings.threads > 0 ? settings.threads : tbb::info::default_concurrency();
}

/// Calls `work` such that its parallel loops use this number of threads.
template <class Work>
void runOnThreads(int threads, const Work& work) {
    // By default, TBB limits the number of threads to the number of cores.
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                      size_t(std::max(threads, 1)));
    tbb::task_arena arena(threads);
    arena.execute(work);
}

} // namespace

Renderer::Renderer(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                   const PixelBounds& pixelBounds)
    : m_scene(scene), m_integrator(integrator), m_shader(shader), m_sampler(sampler), m_filter(filter),
      m_settings(settings), m_pixelBounds(pixelBounds) {}

Renderer::~Renderer() = default;

void Renderer::restart(uint64_t seed, int samplesPerPixel, uint64_t samplesBefore) {
    m_settings.seed = seed;
    m_settings.samplesPerPixel = samplesPerPixel;
    m_settings.samplesBefore = samplesBefore;
    m_settings.slice.reset();
    if (m_state)
        m_state->restart(seed, samplesPerPixel);
}

void Renderer::setSlice(const SampleSlice& slice) { m_settings.slice = slice; }

RenderContext Renderer::makeContext(int threads, const Film& film) const {
    RenderContext context{.sampling = {m_sampler, m_filter, m_settings.seed}};
    context.threads = threads;
    context.samplesPerPixel = m_settings.samplesPerPixel;
    context.isPass = m_settings.isPass;
    context.keepsRecords = film.accumulates();
    context.pixelBounds = m_pixelBounds;
    context.pilotBounds = m_settings.pilotBounds.value_or(m_pixelBounds);
    context.clamp = m_settings.clamp;
    context.hasIndirectLight = m_shader.hasIndirectLight();
    context.lightComponents = m_settings.lightComponents().count();
    if (m_integrator.needsShadeCost(context))
        context.shadeCost =
            measureShadeCost(m_scene, m_shader, m_sampler, m_filter, m_settings, m_pixelBounds);
    context.makePilotRenderer = [this](IntegratorState& state, int samplesPerPixel) {
        return makePilotRenderer(m_scene, state, m_shader, m_sampler, m_filter, samplesPerPixel);
    };
    return context;
}

bool Renderer::render(Film& film) {
    const auto start = std::chrono::steady_clock::now();
    checkSamples(m_settings, m_integrator.dependence());
    const int threads = threadCount(m_settings);
    if (!m_state) {
        runOnThreads(threads, [&] { m_state = m_integrator.begin(m_scene, makeContext(threads, film)); });
        m_stats.beginSeconds = secondsSince(start);
    }
    setNote(film);
    const std::vector<PixelBounds> regions =
        m_settings.regions.empty() ? std::vector{m_pixelBounds} : m_settings.regions;
    const bool isFinished =
        renderTiles(tilesOf(regions, std::clamp(m_settings.tileSize, 1, 1 << 16)), threads, film);
    if (isFinished) {
        ++m_stats.passes;
        m_stats.samplesPerPixel +=
            m_settings.slice ? m_settings.slice->count() : uint64_t(m_settings.samplesPerPixel);
    }
    m_stats.integratorNote = m_state->note();
    m_stats.seconds += secondsSince(start);
    return isFinished;
}

void Renderer::finish(Film& film, std::vector<float>* errors) {
    if (!m_state)
        return;
    const auto start = std::chrono::steady_clock::now();
    runOnThreads(threadCount(m_settings), [&] { m_state->finish(film, errors); });
    const double seconds = secondsSince(start);
    m_stats.finishSeconds += seconds;
    m_stats.seconds += seconds;
}

void Renderer::setNote(Film& film) const {
    const std::string note = m_state->note(), previous = film.records().note();
    if (!previous.empty() && previous != note)
        throw Error("the film has samples of another render: the integrator \"" + previous + "\", not \"" +
                        note + "\"",
                    ErrorKind::Usage);
    film.records().setNote(note);
}

std::vector<PixelBounds> Renderer::missingIn(const PixelBounds& tile, Film& film) const {
    if (!m_settings.resume)
        return {tile};
    const uint32_t samples =
        m_settings.slice ? m_settings.slice->count() : uint32_t(m_settings.samplesPerPixel);
    const auto isMissing = [&](int x, int y) { return !film.hasSampleCount({x, y, x + 1, y + 1}, samples); };
    const std::vector<PixelBounds> missing = rectanglesOf(tile, isMissing);
    for (const PixelBounds& rectangle : missing)
        film.clear(rectangle);
    return missing;
}

/// Renders what the film lacks of a tile. Returns false if settings.stop ended it early. The film then lacks
/// the records of the last rectangle of pixels, so its samples are removed where they may be reused.
bool Renderer::renderTile(const PixelBounds& tile, TileRenderer& renderer, Film& film) const {
    for (const PixelBounds& missing : missingIn(tile, film)) {
        if (!renderer.renderTile(missing, film)) {
            if ((m_state->records() || m_settings.recordsLayers) && !film.sums().empty())
                film.clear(missing);
            return false;
        }
        if (m_settings.recordsLayers) {
            const AovSums* aovs = m_settings.aovs ? &m_settings.aovs->sums() : nullptr;
            const SampleSlice all{0, uint32_t(m_settings.samplesPerPixel)};
            film.layerRecords().add(
                {missing, m_settings.slice.value_or(all), storeLayers(missing, aovs, m_settings.lights)});
        }
    }
    return true;
}

bool Renderer::renderTiles(const std::vector<PixelBounds>& tiles, int threads, Film& film) {
    std::atomic<size_t> finishedTiles{0};
    std::mutex progressMutex;
    const auto makeRenderer = [&] {
        return std::make_unique<TileRenderer>(m_scene, *m_state, m_shader, m_sampler, m_filter, m_settings,
                                              m_integrator.dependence());
    };

    runOnThreads(threads, [&] {
        PerThread<TileRenderer> renderers;
        parallelFor(tiles.size(), [&](size_t i) {
            if (!renderTile(tiles[i], renderers.local(makeRenderer), film))
                return;
            const size_t finished = ++finishedTiles;
            if (m_settings.onTileDone)
                m_settings.onTileDone(film, tiles[i]);
            if (m_settings.onProgress) {
                const std::lock_guard lock(progressMutex);
                m_settings.onProgress(double(finished) / double(tiles.size()));
            }
        });
        size_t thread = 0;
        renderers.forEach([&](TileRenderer& renderer) {
            renderer.finish();
            addCounters(thread++, renderer.counters());
        });
    });

    const bool isFinished = finishedTiles == tiles.size();
    if (!isFinished && !m_settings.stop)
        throw std::logic_error("some tiles were not rendered");
    return isFinished;
}

void Renderer::addCounters(size_t thread, Counters counters) {
    if (m_stats.passes > 0)
        counters.pixels = 0; // later passes render the same pixels
    m_stats.threads.resize(std::max(m_stats.threads.size(), thread + 1));
    m_stats.threads[thread].add(counters);
    m_stats.total.add(counters);
}

RenderStats render(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings, Film& film) {
    Renderer renderer(scene, integrator, shader, sampler, filter, settings, film.pixelBounds());
    if (renderer.render(film) && settings.regions.empty())
        renderer.finish(film);
    return renderer.stats();
}

} // namespace strobe
