#include "core/render/tile_renderer.h"

#include "core/math/hash.h"

#include <bit>

namespace strobe {

namespace {

// Sampler dimensions of the camera sample. AovFilm uses dimensions 3 and 4, shaders use higher ones.
enum : uint32_t { kDimFilm = 0, kDimLens = 1, kDimTime = 2 };

/// The number of samples for which all buffers of a batch fit into a second-level cache.
constexpr uint32_t kBatchSamples = 2048;

} // namespace

TileRenderer::TileRenderer(const Scene& scene, IntegratorState& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           SampleDependence dependence)
    : m_scene(scene), m_moves(scene.moves()), m_sampler(sampler), m_filter(filter), m_settings(settings),
      m_filmSlice(settings.slice.value_or(SampleSlice{0, uint32_t(settings.samplesPerPixel)})),
      m_tracedSlice(dependence == SampleDependence::None
                        ? m_filmSlice
                        : SampleSlice{0, uint32_t(settings.samplesPerPixel)}),
      m_pixelsPerBatch(std::max(1u, kBatchSamples / m_tracedSlice.count())),
      m_components(size_t(settings.lightComponents().count())), m_integrator(integrator.makeWorker()),
      m_shader(scene, shader.makeWorker(scene, sampler, settings.lightComponents()), m_components) {
    m_counters.shadeCosts.resize(scene.materials().size() + 1);
    initializeSamples();
}

/// Writes the members of samples that do not change from batch to batch: the pixel, the sample number, and
/// the time and lens position for scenes that do not sample them.
void TileRenderer::initializeSamples() {
    m_samples.resize(size_t(m_pixelsPerBatch) * m_tracedSlice.count());
    for (size_t c = 0; c < m_samples.chunks(); ++c) {
        VisibilitySoA& chunk = m_samples.chunk(c);
        for (uint32_t i = 0; i < kSoAWidth; ++i) {
            const uint32_t sample = uint32_t(c * kSoAWidth) + i;
            chunk.pixel[i] = sample / m_tracedSlice.count();
            chunk.index[i] = m_tracedSlice.first + sample % m_tracedSlice.count();
            chunk.camera.time[i] = 0.5f;
            chunk.camera.lens.set(int(i), V2f(0.5f));
        }
    }
}

bool TileRenderer::renderTile(const PixelBounds& tile, Film& film) {
    const ScopedFlushDenormals flushDenormals;
    // A batch is about square, so that its samples hit, and share, nearby surfaces.
    const int rows = 1 << (std::bit_width(m_pixelsPerBatch) - 1) / 2;
    const auto render = [&] {
        if (m_settings.stop && m_settings.stop())
            return false;
        renderBatch(film);
        return true;
    };
    m_integrator->beginTile();
    m_pixels.clear();
    for (int top = tile.y0; top < tile.y1; top += rows) {
        for (int x = tile.x0; x < tile.x1; ++x) {
            const uint64_t column = hashOf(m_settings.seed, x);
            for (int y = top; y < std::min(top + rows, tile.y1); ++y) {
                m_pixels.push_back({x, y, hashCombine(column, uint64_t(y))});
                if (m_pixels.size() == m_pixelsPerBatch && !render())
                    return false;
            }
        }
    }
    return m_pixels.empty() || render();
}

void TileRenderer::renderBatch(Film& film) {
    StageClock clock(m_counters);
    generate();
    clock.charge(Stage::Generate);
    trace();
    clock.charge(Stage::Trace);
    const VisibilityBatch batch{m_pixels, m_samples, uint32_t(m_settings.samplesPerPixel), m_tracedSlice,
                                m_filmSlice};
    m_requests.clear();
    m_integrator->plan(batch, m_requests);
    clock.charge(Stage::Plan);
    shade();
    clock.charge(Stage::Shade);
    resolve(batch);
    clock.charge(Stage::Resolve);
    if (m_settings.clamp > 0)
        clampValues();
    accumulate(film);
    accumulateComponents(batch, clock);
    writeAovs(batch, film);
    clock.charge(Stage::Film);
    m_counters.pixels += m_pixels.size();
    m_counters.visibilitySamples += m_samples.size();
    m_pixels.clear();
}

void TileRenderer::generate() {
    m_samples.resize(m_pixels.size() * m_tracedSlice.count());
    for (size_t c = 0; c < m_samples.chunks(); ++c)
        generateChunk(uint32_t(c * kSoAWidth), m_samples.chunkSize(c), m_samples.chunk(c));
}

namespace {

/// Sets values[begin … begin+n-1], in groups of four: it may overwrite up to three values behind them, so
/// fill ranges in ascending order.
void fillRange(float (&values)[kSoAWidth], uint32_t begin, uint32_t n, float value) {
    constexpr uint32_t kGroup = 4;
    uint32_t k = 0;
    for (; k < n && begin + k + kGroup <= kSoAWidth; k += kGroup)
        std::fill_n(values + begin + k, kGroup, value);
    for (; k < n; ++k)
        values[begin + k] = value;
}

STROBE_TARGET_CLONES void addOffsets(int n, V2SoA& film, const V2SoA& offset) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        film.x[i] += offset.x[i];
        film.y[i] += offset.y[i];
    }
}

} // namespace

/// Writes all members but the hits of samples first … first+n-1 of the batch.
void TileRenderer::generateChunk(uint32_t first, int n, VisibilitySoA& out) {
    const uint32_t samplesPerPixel = uint32_t(m_settings.samplesPerPixel);
    const uint32_t sliceCount = m_tracedSlice.count(), end = first + uint32_t(n);
    CameraSampleSoA& sample = out.camera;
    m_ranges.clear();
    for (uint32_t i = first, count; i < end; i += count) { // runs of samples of one pixel
        const uint32_t index = i % sliceCount;
        count = std::min(sliceCount - index, end - i);
        const PixelRef& pixel = m_pixels[i / sliceCount];
        m_ranges.push_back({pixel.domain, m_tracedSlice.first + index, count, samplesPerPixel});
        fillRange(sample.film.x, i - first, count, float(pixel.x) + 0.5f);
        fillRange(sample.film.y, i - first, count, float(pixel.y) + 0.5f);
    }
    V2SoA u, offset;
    m_sampler.fill2D(m_ranges, kDimFilm, u);
    if (m_moves)
        m_sampler.fill1D(m_ranges, kDimTime, sample.time);
    if (m_scene.camera().hasLens())
        m_sampler.fill2D(m_ranges, kDimLens, sample.lens);
    m_filter.sampleSoA(u, n, offset, out.weight);
    addOffsets(n, sample.film, offset);
    m_scene.camera().raySoA(sample, n, out.ray);
}

void TileRenderer::trace() {
    const Tracer& tracer = m_scene.tracer();
    constexpr int kSize = RayPacket::kSize;
    static_assert(kSoAWidth % kSize == 0);
    for (size_t c = 0; c < m_samples.chunks(); ++c) {
        VisibilitySoA& chunk = m_samples.chunk(c);
        const int count = m_samples.chunkSize(c);
        for (int first = 0; first < count; first += kSize) {
            m_packet.setCamera(chunk.ray, chunk.camera.time, first);
            tracer.intersect(m_packet, std::min(kSize, count - first), true);
            tracer.hits(m_packet, chunk.hit, first);
        }
    }
}

void TileRenderer::shade() {
    m_shaded.resize(m_requests.size() * (1 + m_components));
    m_shader.shade(m_requests, m_shaded, m_counters);
}

void TileRenderer::resolve(const VisibilityBatch& batch) {
    m_resolved.resize(m_samples.size());
    m_values =
        m_integrator->resolve(batch, std::span<const Rgb>(m_shaded).first(m_requests.size()), m_resolved);
}

/// Resolves the components of the radiance and adds them to settings.lights.
void TileRenderer::accumulateComponents(const VisibilityBatch& batch, StageClock& clock) {
    const size_t n = m_requests.size();
    for (size_t component = 0; component < m_components; ++component) {
        m_componentValues.resize(m_samples.size());
        const auto shaded = std::span<const Rgb>(m_shaded).subspan((1 + component) * n, n);
        clock.charge(Stage::Film);
        std::span<const Rgb> values =
            m_integrator->resolveComponent(batch, shaded, m_componentValues, int(component));
        clock.charge(Stage::Resolve);
        if (m_settings.clamp > 0)
            values = applyClamp(values, m_componentValues);
        accumulateComponent(int(component), values);
    }
}

void TileRenderer::writeAovs(const VisibilityBatch& batch, Film& film) {
    if (!film.layers().empty())
        m_sharingAovs.write(batch, m_requests, *m_integrator, film);
    if (m_settings.aovs)
        m_settings.aovs->add(batch, m_counters);
    if (m_settings.onSample)
        SharingAovs::reportSamples(batch, m_requests, *m_integrator, m_values, m_settings.onSample);
}

/// Scales finite values with a channel above settings.clamp down to it.
void TileRenderer::clampValues() {
    m_clampScales.assign(m_values.size(), 1.f);
    for (size_t i = 0; i < m_values.size(); ++i) {
        const Rgb& value = m_values[i];
        const float maxChannel = std::max({value.x, value.y, value.z});
        if (!(maxChannel > m_settings.clamp) || !std::isfinite(value.x + value.y + value.z))
            continue;
        m_clampScales[i] = m_settings.clamp / maxChannel;
        m_counters.clampedSamples += m_filmSlice.contains(m_samples[i].index);
    }
    m_values = applyClamp(m_values, m_resolved);
}

/// Writes the products of values and m_clampScales to `clamped`, and returns it.
std::span<const Rgb> TileRenderer::applyClamp(std::span<const Rgb> values, std::span<Rgb> clamped) const {
    for (size_t i = 0; i < values.size(); ++i)
        clamped[i] = values[i] * m_clampScales[i];
    return clamped;
}

/// Returns the index of a pixel's first sample in m_filmSlice; the others follow it.
uint32_t TileRenderer::firstFilmSample(uint32_t pixel) const {
    return pixel * m_tracedSlice.count() + m_filmSlice.first - m_tracedSlice.first;
}

/// Adds m_values to the film. Samples are converted to fixed point chunk by chunk.
void TileRenderer::accumulate(Film& film) {
    FixedPointSamples converted;
    size_t convertedChunk = m_samples.chunks();
    bool isConverted = false;
    for (uint32_t p = 0; p < m_pixels.size(); ++p) {
        PixelAccumulator sum;
        const uint32_t first = firstFilmSample(p);
        for (uint32_t i = first, end = first + m_filmSlice.count(), n; i < end; i += n) {
            const size_t chunk = i / kSoAWidth;
            const uint32_t begin = i % kSoAWidth;
            n = std::min(end - i, kSoAWidth - begin);
            if (chunk != convertedChunk) {
                convertedChunk = chunk;
                isConverted = converted.set(&m_values[i - begin], m_samples.chunk(chunk).weight,
                                            m_samples.chunkSize(chunk));
            }
            if (isConverted)
                sum.add(converted, int(begin), int(n));
            else
                addOneByOne(sum, i, n);
        }
        film.add(m_pixels[p].x, m_pixels[p].y, sum);
    }
}

void TileRenderer::addOneByOne(PixelAccumulator& sum, uint32_t first, uint32_t n) {
    for (uint32_t i = first; i < first + n; ++i)
        if (!sum.add(m_values[i], m_samples[i].weight))
            recordInvalidSample(m_pixels[m_samples[i].pixel], m_samples[i].index);
}

/// Adds one component of the radiance to settings.lights, for samples whose whole radiance is valid.
void TileRenderer::accumulateComponent(int component, std::span<const Rgb> values) {
    for (uint32_t p = 0; p < m_pixels.size(); ++p) {
        PixelAccumulator sum, whole;
        const uint32_t first = firstFilmSample(p);
        for (uint32_t i = first; i < first + m_filmSlice.count(); ++i)
            if (whole.add(m_values[i], m_samples[i].weight))
                sum.add(values[i], m_samples[i].weight);
        m_settings.lights->add(component, m_pixels[p].x, m_pixels[p].y, sum);
    }
}

void TileRenderer::recordInvalidSample(const PixelRef& pixel, uint32_t sample) {
    ++m_counters.invalidSamples;
    if (m_counters.firstInvalid.size() < Counters::kMaxRecordedInvalid)
        m_counters.firstInvalid.push_back(
            {pixel.x, pixel.y, sample, m_settings.seed, m_settings.samplesPerPixel});
}

} // namespace strobe
