#include "core/render/tile_renderer.h"

#include "core/math/hash.h"

#include <bit>
#include <numeric>

namespace strobe {

namespace {

// Dimensions of the camera sample; shading's begin beyond.
enum : uint32_t { kDimFilm = 0, kDimLens = 1, kDimTime = 2 };

/// About as many samples as keep all buffers of a batch in the second-level cache.
constexpr uint32_t kBatchSamples = 2048;
/// Shades timed together: the rays of so many are traced about as well as those of a batch.
constexpr size_t kMeteredPacket = 16;

/// Pictures of the sharing show what is shared.
bool countsAsShade(const ShadingRequest& request) {
    return request.hit &&
           (request.component == LightComponent::All || request.component == LightComponent::Indirect);
}

} // namespace

TileRenderer::TileRenderer(const Scene& scene, IntegratorState& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           SampleDependence dependence)
    : m_scene(scene), m_moves(scene.moves()), m_sampler(sampler), m_filter(filter), m_settings(settings),
      m_wanted(settings.slice.value_or(SampleSlice{0, uint32_t(settings.samplesPerPixel)})),
      m_slice(dependence == SampleDependence::None ? m_wanted
                                                   : SampleSlice{0, uint32_t(settings.samplesPerPixel)}),
      m_pixelsPerBatch(std::max(1u, kBatchSamples / m_slice.count())), m_integrator(integrator.makeWorker()),
      m_shader(shader.makeWorker(scene, sampler, settings.lightComponents())),
      m_components(size_t(settings.lightComponents().count())) {
    m_counters.shadeCosts.resize(scene.materials().size() + 1);
    initializeLayout();
}

/// What is the same in every batch: which samples are whose, and numbers that nobody draws.
void TileRenderer::initializeLayout() {
    m_samples.resize(size_t(m_pixelsPerBatch) * m_slice.count());
    for (size_t b = 0; b < m_samples.chunks(); ++b) {
        VisibilitySoA& lanes = m_samples.chunk(b);
        for (uint32_t i = 0; i < kSoAWidth; ++i) {
            const uint32_t sample = uint32_t(b * kSoAWidth) + i;
            lanes.pixel[i] = sample / m_slice.count(),
            lanes.index[i] = m_slice.first + sample % m_slice.count();
            lanes.camera.time[i] = lanes.camera.lens.x[i] = lanes.camera.lens.y[i] = 0.5f;
        }
    }
}

bool TileRenderer::renderTile(const PixelBounds& tile, Film& film) {
    const ScopedFlushDenormals fast;
    // A batch is about as high as wide: what its samples meet, and share, lies close together.
    const int rows = 1 << (std::bit_width(m_pixelsPerBatch) - 1) / 2;
    const auto render = [&] {
        if (m_settings.stop && m_settings.stop())
            return false;
        renderBatch(film);
        return true;
    };
    m_integrator->beginTile();
    m_pixels.clear();
    for (int top = tile.y0; top < tile.y1; top += rows)
        for (int x = tile.x0; x < tile.x1; ++x) {
            const uint64_t column = hashOf(m_settings.seed, x);
            for (int y = top; y < std::min(top + rows, tile.y1); ++y) {
                m_pixels.push_back({x, y, hashCombine(column, uint64_t(y))});
                if (m_pixels.size() == m_pixelsPerBatch && !render())
                    return false;
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
    const VisibilityBatch batch{m_pixels, m_samples, uint32_t(m_settings.samplesPerPixel), m_slice, m_wanted};
    m_requests.clear();
    m_integrator->plan(batch, m_requests);
    clock.charge(Stage::Plan);
    shade();
    clock.charge(Stage::Shade);
    m_resolved.resize(m_samples.size());
    const std::span<const Rgb> shaded(m_shaded);
    m_values = m_integrator->resolve(batch, shaded.first(m_requests.size()), m_resolved);
    clock.charge(Stage::Resolve);
    if (m_settings.clamp > 0)
        clampValues();
    accumulate(film);
    for (size_t component = 0; component < m_components; ++component) {
        m_componentRoom.resize(m_samples.size());
        const std::span<const Rgb> componentShades =
            shaded.subspan((1 + component) * m_requests.size(), m_requests.size());
        clock.charge(Stage::Film);
        std::span<const Rgb> values =
            m_integrator->resolveComponent(batch, componentShades, m_componentRoom, int(component));
        clock.charge(Stage::Resolve);
        if (m_settings.clamp > 0)
            values = dimmed(values, m_componentRoom);
        accumulateComponent(int(component), values);
    }
    if (!film.layers().empty())
        describe(film);
    if (m_settings.aovs)
        m_settings.aovs->add(batch, m_counters);
    if (m_settings.onSample)
        probe();
    clock.charge(Stage::Film);
    m_counters.pixels += m_pixels.size();
    m_counters.visibilitySamples += m_samples.size(); // traced, wanted or not
    m_pixels.clear();
}

void TileRenderer::generate() {
    m_samples.resize(m_pixels.size() * m_slice.count());
    for (size_t b = 0; b < m_samples.chunks(); ++b)
        generate(uint32_t(b * kSoAWidth), m_samples.chunkSize(b), m_samples.chunk(b));
}

namespace {

/// Fills lanes `at` to `at + n` of a row, in fours; so it may write lanes after them, too, which are filled
/// next.
void fillRun(float (&row)[kSoAWidth], uint32_t at, uint32_t n, float value) {
    constexpr uint32_t kFour = 4;
    uint32_t k = 0;
    for (; k < n && at + k + kFour <= kSoAWidth; k += kFour)
        std::fill_n(row + at + k, kFour, value);
    for (; k < n; ++k)
        row[at + k] = value;
}

STROBE_TARGET_CLONES void addOffsets(int n, V2SoA& film, const V2SoA& offset) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        film.x[i] += offset.x[i], film.y[i] += offset.y[i];
}

} // namespace

/// The batch's samples `first` to `first + n`, but for their hits.
void TileRenderer::generate(uint32_t first, int n, VisibilitySoA& out) {
    const uint32_t spp = uint32_t(m_settings.samplesPerPixel), inSlice = m_slice.count();
    const uint32_t end = first + uint32_t(n);
    CameraSampleSoA& sample = out.camera;
    m_ranges.clear();
    for (uint32_t i = first; i < end;) {
        const uint32_t p = i / inSlice, index = i % inSlice, count = std::min(inSlice - index, end - i);
        const PixelRef& pixel = m_pixels[p];
        m_ranges.push_back({pixel.domain, m_slice.first + index, count, spp});
        const uint32_t at = i - first;
        fillRun(sample.film.x, at, count, float(pixel.x) + 0.5f);
        fillRun(sample.film.y, at, count, float(pixel.y) + 0.5f);
        i += count;
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
    for (size_t b = 0; b < m_samples.chunks(); ++b) {
        VisibilitySoA& lanes = m_samples.chunk(b);
        const int count = m_samples.chunkSize(b);
        for (int first = 0; first < count; first += kSize) {
            m_block.setCamera(lanes.ray, lanes.camera.time, first);
            tracer.intersect(m_block, std::min(kSize, count - first), true);
            tracer.hits(m_block, lanes.hit, first);
        }
    }
}

void TileRenderer::shade() {
    m_shaded.resize(m_requests.size() * (1 + m_components));
    // The first batch of a thread is slow for other reasons. Of the next, some more, for small pictures.
    const uint32_t batch = m_batches++;
    const bool isPowerOf16 = std::has_single_bit(batch) && std::countr_zero(batch) % 4 == 0;
    if (batch > 0 && (batch % m_meterInterval == 0 || isPowerOf16))
        shadeMetered();
    else
        m_shader->shade(m_requests, m_shaded, m_counters);
}

size_t TileRenderer::costSlot(const Hit& hit) const {
    return hit ? size_t(m_scene.geometry(hit).material) : m_scene.materials().size();
}

void TileRenderer::shadeMetered() {
    m_order.resize(m_requests.size());
    std::iota(m_order.begin(), m_order.end(), 0u);
    m_slots.resize(m_requests.size());
    for (size_t i = 0; i < m_slots.size(); ++i)
        m_slots[i] = uint32_t(costSlot(m_requests[i].hit));
    std::stable_sort(m_order.begin(), m_order.end(),
                     [&](uint32_t a, uint32_t b) { return m_slots[a] < m_slots[b]; });
    std::vector<Rgb> shaded(kMeteredPacket * (1 + m_components));
    for (size_t first = 0; first < m_order.size(); first += m_packet.size()) {
        const uint32_t slot = m_slots[m_order[first]];
        m_packet.clear();
        for (size_t i = first; i < m_order.size() && m_packet.size() < kMeteredPacket; ++i) {
            if (m_slots[m_order[i]] != slot)
                break;
            m_packet.push_back(m_requests[m_order[i]]);
        }
        const auto start = std::chrono::steady_clock::now();
        m_shader->shade(m_packet, std::span(shaded).first(m_packet.size() * (1 + m_components)), m_counters);
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        m_counters.shadeCosts[slot].add(m_packet.size(), seconds.count());
        for (size_t i = 0; i < m_packet.size(); ++i)
            for (size_t component = 0; component <= m_components; ++component)
                m_shaded[component * m_requests.size() + m_order[first + i]] =
                    shaded[component * m_packet.size() + i];
    }
}

void TileRenderer::clampValues() {
    m_dimming.assign(m_values.size(), 1.f);
    for (size_t i = 0; i < m_values.size(); ++i) {
        const Rgb& c = m_values[i];
        const float most = std::max({c.x, c.y, c.z});
        if (!(most > m_settings.clamp) || !std::isfinite(c.x + c.y + c.z))
            continue;
        m_dimming[i] = m_settings.clamp / most;
        m_counters.clampedSamples += m_wanted.contains(m_samples[i].index);
    }
    m_values = dimmed(m_values, m_resolved);
}

std::span<const Rgb> TileRenderer::dimmed(std::span<const Rgb> values, std::span<Rgb> room) const {
    for (size_t i = 0; i < values.size(); ++i)
        room[i] = values[i] * m_dimming[i];
    return room;
}

void TileRenderer::accumulate(Film& film) {
    FixedPointSamples samplesFixed;
    bool ready = false;
    size_t block = m_samples.chunks(); // that `samplesFixed` are of
    for (uint32_t p = 0; p < m_pixels.size(); ++p) {
        PixelAccumulator sum;
        const uint32_t first = p * m_slice.count() + m_wanted.first - m_slice.first;
        for (uint32_t i = first, end = first + m_wanted.count(), n; i < end; i += n) {
            const uint32_t lane = i % kSoAWidth;
            n = std::min(end - i, kSoAWidth - lane);
            if (i / kSoAWidth != block) {
                block = i / kSoAWidth;
                ready = samplesFixed.set(&m_values[i - lane], m_samples.chunk(block).weight,
                                         m_samples.chunkSize(block));
            }
            if (ready)
                sum.add(samplesFixed, int(lane), int(n));
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

/// A part of the light, of the samples that are numbers as a whole.
void TileRenderer::accumulateComponent(int component, std::span<const Rgb> values) {
    for (uint32_t p = 0; p < m_pixels.size(); ++p) {
        PixelAccumulator sum, whole;
        const uint32_t first = p * m_slice.count() + m_wanted.first - m_slice.first;
        for (uint32_t i = first; i < first + m_wanted.count(); ++i)
            if (whole.add(m_values[i], m_samples[i].weight))
                sum.add(values[i], m_samples[i].weight);
        m_settings.lights->add(component, m_pixels[p].x, m_pixels[p].y, sum);
    }
}

/// The film's layers, from who asked for which shade.
void TileRenderer::describe(Film& film) {
    m_tallies.assign(m_pixels.size(), {});
    for (const VisibilitySample& sample : m_samples)
        m_tallies[sample.pixel].hits += bool(sample.hit);
    m_order.clear();
    for (const ShadingRequest& request : m_requests) {
        if (!countsAsShade(request))
            continue;
        PixelTally& tally = m_tallies[m_samples[request.sample].pixel];
        ++tally.shades, tally.time += request.ray.time;
        m_order.push_back(request.sample);
    }
    std::sort(m_order.begin(), m_order.end());
    m_order.erase(std::unique(m_order.begin(), m_order.end()), m_order.end());
    for (uint32_t sample : m_order)
        ++m_tallies[m_samples[sample].pixel].asked;

    const auto valueOf = [&](Aov layer, uint32_t p) {
        const PixelTally& tally = m_tallies[p];
        switch (layer) {
        case Aov::Shades:
            return float(tally.shades);
        case Aov::Samples:
            return float(m_wanted.count());
        case Aov::HitRate:
            return tally.hits ? 1 - float(tally.asked) / float(tally.hits) : 0;
        case Aov::Cell:
            return float(m_integrator->sharingId(size_t(p) * m_slice.count()) >> 40);
        case Aov::ShadeTime:
            return tally.shades ? float(tally.time / tally.shades) : -1;
        default: // Variance is of passes
            return 0.f;
        }
    };
    for (size_t l = 0; l < film.layers().size(); ++l)
        for (uint32_t p = 0; p < m_pixels.size(); ++p)
            film.setLayer(l, m_pixels[p].x, m_pixels[p].y, valueOf(film.layers()[l], p));
}

void TileRenderer::probe() {
    std::vector<uint32_t> asked(m_samples.size());
    for (const ShadingRequest& request : m_requests)
        asked[request.sample] += countsAsShade(request);
    for (size_t i = 0; i < m_samples.size(); ++i) {
        const VisibilitySample& sample = m_samples[i];
        if (!m_wanted.contains(sample.index))
            continue;
        const PixelRef& pixel = m_pixels[sample.pixel];
        m_settings.onSample(
            {pixel.x, pixel.y, sample.index, sample, m_values[i], m_integrator->sharingId(i), asked[i]});
    }
}

void TileRenderer::recordInvalidSample(const PixelRef& pixel, uint32_t sample) {
    ++m_counters.invalidSamples;
    if (m_counters.firstInvalid.size() < 16)
        m_counters.firstInvalid.push_back(
            {pixel.x, pixel.y, sample, m_settings.seed, m_settings.samplesPerPixel});
}

} // namespace strobe
