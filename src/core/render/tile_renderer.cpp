#include "core/render/tile_renderer.h"

#include "core/math/hash.h"

#include <bit>
#include <utility>

namespace strobe {

TileRenderer::TileRenderer(const Scene& scene, IntegratorState& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           SampleDependence dependence)
    : m_settings(settings), m_scene(scene), m_sampler(sampler), m_filter(filter), m_dependence(dependence),
      m_factors(integrator.sampleFactors()), m_observes(integrator.observes()),
      m_components(size_t(settings.lightComponents().count())), m_integrator(integrator.makeWorker()),
      m_shader(scene, shader.makeWorker(scene, sampler, settings.lightComponents()), m_components) {
    m_counters.shadeCosts.resize(scene.materials().size() + 1);
}

Counters TileRenderer::takeCounters() {
    Counters empty;
    empty.shadeCosts.resize(m_counters.shadeCosts.size());
    return std::exchange(m_counters, std::move(empty));
}

TileRenderer::Sampling& TileRenderer::samplingFor(uint32_t factor) {
    for (const auto& sampling : m_samplings)
        if (sampling->factor == factor)
            return *sampling;
    const uint32_t samplesPerPixel = factor * uint32_t(m_settings.samplesPerPixel);
    const SampleSlice all{0, samplesPerPixel};
    const SampleSlice film =
        m_settings.slice ? SampleSlice{factor * m_settings.slice->first, factor * m_settings.slice->end}
                         : all;
    const SampleSlice traced = m_dependence == SampleDependence::None ? film : all;
    const uint32_t pixelsPerBatch = std::max(1u, m_batchSamples / traced.count());
    m_samplings.push_back(std::unique_ptr<Sampling>(new Sampling{
        factor,
        samplesPerPixel,
        film,
        traced,
        pixelsPerBatch,
        {m_scene, m_sampler, m_filter, samplesPerPixel, traced, factor * m_settings.samplesBefore},
        {}}));
    return *m_samplings.back();
}

bool TileRenderer::renderTile(const PixelBounds& tile, Film& film) {
    const ScopedFlushDenormals flushDenormals;
    m_integrator->beginTile(film);
    m_pixels.clear();
    for (const uint32_t factor : m_factors ? m_factors->in(tile) : std::vector<uint32_t>{1})
        if (!renderPixelsOf(tile, factor, film))
            return false;
    m_integrator->endTile(tile, film);
    return true;
}

void TileRenderer::renderPixels(std::span<const V2i> pixels, Film& film) {
    const ScopedFlushDenormals flushDenormals;
    m_integrator->beginTile(film);
    m_pixels.clear();
    m_sampling = &samplingFor(1);
    for (const V2i& pixel : pixels) {
        m_pixels.push_back({pixel.x, pixel.y, pixelDomain(m_settings.seed, pixel.x, pixel.y)});
        if (m_pixels.size() == m_sampling->pixelsPerBatch)
            renderBatch(film);
    }
    if (!m_pixels.empty())
        renderBatch(film);
    m_integrator->endTile(film.pixelBounds(), film);
}

/// Renders the pixels of a tile that have this factor. Returns false if settings.stop ended it early.
bool TileRenderer::renderPixelsOf(const PixelBounds& tile, uint32_t factor, Film& film) {
    m_sampling = &samplingFor(factor);
    // A batch is about square, so that its samples hit, and share, nearby surfaces.
    const int rows = 1 << (std::bit_width(m_sampling->pixelsPerBatch) - 1) / 2;
    const auto render = [&] {
        if (m_settings.stop && m_settings.stop())
            return false;
        renderBatch(film);
        return true;
    };
    for (int top = tile.y0; top < tile.y1; top += rows) {
        for (int x = tile.x0; x < tile.x1; ++x) {
            for (int y = top; y < std::min(top + rows, tile.y1); ++y) {
                if (m_factors && m_factors->at(x, y) != factor)
                    continue;
                m_pixels.push_back({x, y, pixelDomain(m_settings.seed, x, y)});
                if (m_pixels.size() == m_sampling->pixelsPerBatch && !render())
                    return false;
            }
        }
    }
    return m_pixels.empty() || render();
}

void TileRenderer::renderBatch(Film& film) {
    StageClock clock(m_counters);
    m_sampling->tracer.generate(m_pixels, m_sampling->samples);
    clock.charge(Stage::Generate);
    m_sampling->tracer.trace(m_sampling->samples);
    clock.charge(Stage::Trace);
    const VisibilityBatch batch{m_pixels,
                                samples(),
                                m_sampling->samplesPerPixel,
                                m_sampling->tracedSlice,
                                m_sampling->filmSlice,
                                m_sampling->factor};
    m_requests.clear();
    m_integrator->plan(batch, m_requests);
    clock.charge(Stage::Plan);
    shade();
    clock.charge(Stage::Shade);
    resolve(batch);
    if (m_observes)
        m_integrator->observe(batch, std::span<const Rgb>(m_shaded).first(m_requests.size()),
                              m_firstVertices);
    clock.charge(Stage::Resolve);
    if (m_settings.clamp > 0)
        clampValues();
    accumulate(film);
    accumulateComponents(batch, clock);
    writeAovs(batch, film);
    clock.charge(Stage::Film);
    m_counters.pixels += m_pixels.size();
    m_counters.visibilitySamples += samples().size();
    m_pixels.clear();
}

void TileRenderer::shade() {
    m_shaded.resize(m_requests.size() * (1 + m_components));
    m_firstVertices.resize(m_observes ? m_requests.size() : 0);
    m_shader.shade(m_requests, {m_shaded, m_firstVertices}, m_counters);
}

void TileRenderer::resolve(const VisibilityBatch& batch) {
    m_resolved.resize(samples().size());
    m_values =
        m_integrator->resolve(batch, std::span<const Rgb>(m_shaded).first(m_requests.size()), m_resolved);
}

/// Resolves the components of the radiance and adds them to settings.lights.
void TileRenderer::accumulateComponents(const VisibilityBatch& batch, StageClock& clock) {
    const size_t n = m_requests.size();
    for (size_t component = 0; component < m_components; ++component) {
        m_componentValues.resize(samples().size());
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
        m_counters.clampedSamples += m_sampling->filmSlice.contains(samples()[i].index);
    }
    m_values = applyClamp(m_values, m_resolved);
}

/// Writes the products of values and m_clampScales to `clamped`, and returns it.
std::span<const Rgb> TileRenderer::applyClamp(std::span<const Rgb> values, std::span<Rgb> clamped) const {
    for (size_t i = 0; i < values.size(); ++i)
        clamped[i] = values[i] * m_clampScales[i];
    return clamped;
}

/// Returns the index of a pixel's first sample in m_sampling->filmSlice; the others follow it.
uint32_t TileRenderer::firstFilmSample(uint32_t pixel) const {
    return pixel * m_sampling->tracedSlice.count() + m_sampling->filmSlice.first -
           m_sampling->tracedSlice.first;
}

/// Adds m_values to the film. Samples are converted to fixed point chunk by chunk.
void TileRenderer::accumulate(Film& film) {
    FixedPointSamples converted;
    size_t convertedChunk = samples().chunks();
    bool isConverted = false;
    for (uint32_t p = 0; p < m_pixels.size(); ++p) {
        PixelAccumulator sum;
        const uint32_t first = firstFilmSample(p);
        for (uint32_t i = first, end = first + m_sampling->filmSlice.count(), n; i < end; i += n) {
            const size_t chunk = i / kSoAWidth;
            const uint32_t begin = i % kSoAWidth;
            n = std::min(end - i, kSoAWidth - begin);
            if (chunk != convertedChunk) {
                convertedChunk = chunk;
                isConverted = converted.set(&m_values[i - begin], samples().chunk(chunk).weight,
                                            samples().chunkSize(chunk));
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
        if (!sum.add(m_values[i], samples()[i].weight))
            recordInvalidSample(m_pixels[samples()[i].pixel], samples()[i].index);
}

/// Adds one component of the radiance to settings.lights, for samples whose whole radiance is valid.
void TileRenderer::accumulateComponent(int component, std::span<const Rgb> values) {
    for (uint32_t p = 0; p < m_pixels.size(); ++p) {
        PixelAccumulator sum, whole;
        const uint32_t first = firstFilmSample(p);
        for (uint32_t i = first; i < first + m_sampling->filmSlice.count(); ++i)
            if (whole.add(m_values[i], samples()[i].weight))
                sum.add(values[i], samples()[i].weight);
        m_settings.lights->add(component, m_pixels[p].x, m_pixels[p].y, sum);
    }
}

void TileRenderer::recordInvalidSample(const PixelRef& pixel, uint32_t sample) {
    ++m_counters.invalidSamples;
    if (m_counters.firstInvalid.size() < Counters::kMaxRecordedInvalid)
        m_counters.firstInvalid.push_back(
            {pixel.x, pixel.y, sample, m_settings.seed, int(m_sampling->samplesPerPixel)});
}

} // namespace strobe
