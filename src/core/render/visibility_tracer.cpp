#include "core/render/visibility_tracer.h"

namespace strobe {

namespace {

// Sampler dimensions of the camera sample. AovFilm uses dimensions 3 and 4, shaders use higher ones.
enum : uint32_t { kDimFilm = 0, kDimLens = 1, kDimTime = 2 };

} // namespace

VisibilityTracer::VisibilityTracer(const Scene& scene, const Sampler& sampler, const Filter& filter,
                                   uint32_t samplesPerPixel, const SampleSlice& slice, uint64_t samplesBefore)
    : m_scene(scene), m_sampler(sampler), m_filter(filter), m_signs(filter.negativeFraction()),
      m_moves(scene.moves()), m_samplesPerPixel(samplesPerPixel), m_slice(slice),
      m_samplesBefore(samplesBefore) {
    std::fill(std::begin(m_packet.id), std::end(m_packet.id), RayPacket::kCameraId);
}

/// Writes the members of samples that do not change from batch to batch: the pixel, the sample number, the
/// filter weight, and the time and lens position for scenes that do not sample them.
void VisibilityTracer::initialize(VisibilitySoA& chunk, size_t index) const {
    for (uint32_t i = 0; i < kSoAWidth; ++i) {
        const uint32_t sample = uint32_t(index * kSoAWidth) + i;
        chunk.pixel[i] = sample / m_slice.count();
        chunk.index[i] = m_slice.first + sample % m_slice.count();
        chunk.weight[i] = m_signs.isNegative(m_samplesBefore + chunk.index[i]) ? -1.f : 1.f;
        chunk.camera.time[i] = 0.5f;
        chunk.camera.lens.set(int(i), V2f(0.5f));
    }
}

void VisibilityTracer::generate(std::span<const PixelRef> pixels, SoAVector<VisibilitySoA>& samples) {
    samples.resize(pixels.size() * m_slice.count());
    for (; m_initializedChunks < samples.chunks(); ++m_initializedChunks)
        initialize(samples.chunk(m_initializedChunks), m_initializedChunks);
    for (size_t c = 0; c < samples.chunks(); ++c)
        generateChunk(pixels, uint32_t(c * kSoAWidth), samples.chunkSize(c), samples.chunk(c));
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
void VisibilityTracer::generateChunk(std::span<const PixelRef> pixels, uint32_t first, int n,
                                     VisibilitySoA& out) {
    const uint32_t sliceCount = m_slice.count(), end = first + uint32_t(n);
    CameraSampleSoA& sample = out.camera;
    m_ranges.clear();
    for (uint32_t i = first, count; i < end; i += count) { // runs of samples of one pixel
        const uint32_t index = i % sliceCount;
        count = std::min(sliceCount - index, end - i);
        const PixelRef& pixel = pixels[i / sliceCount];
        m_ranges.push_back({pixel.domain, m_slice.first + index, count, m_samplesPerPixel});
        fillRange(sample.film.x, i - first, count, float(pixel.x) + 0.5f);
        fillRange(sample.film.y, i - first, count, float(pixel.y) + 0.5f);
    }
    V2SoA u, offset;
    m_sampler.fill2D(m_ranges, kDimFilm, u);
    if (m_moves)
        m_sampler.fill1D(m_ranges, kDimTime, sample.time);
    if (m_scene.camera().hasLens())
        m_sampler.fill2D(m_ranges, kDimLens, sample.lens);
    m_filter.sampleSoA(u, n, offset);
    if (m_signs.hasNegative())
        moveToNegativeLobes(pixels, n, out, offset);
    addOffsets(n, sample.film, offset);
    m_scene.camera().raySoA(sample, n, out.ray);
}

/// Replaces the filter offsets of the samples with negative weights.
void VisibilityTracer::moveToNegativeLobes(std::span<const PixelRef> pixels, int n,
                                           const VisibilitySoA& chunk, V2SoA& offset) const {
    for (int i = 0; i < n; ++i)
        if (chunk.weight[i] < 0)
            offset.set(i, m_filter.sampleNegative(m_signs.point(m_samplesBefore + chunk.index[i],
                                                                pixels[chunk.pixel[i]].domain)));
}

void VisibilityTracer::trace(SoAVector<VisibilitySoA>& samples) {
    const Tracer& tracer = m_scene.tracer();
    constexpr int kSize = RayPacket::kSize;
    static_assert(kSoAWidth % kSize == 0);
    for (size_t c = 0; c < samples.chunks(); ++c) {
        VisibilitySoA& chunk = samples.chunk(c);
        const int count = samples.chunkSize(c);
        for (int first = 0; first < count; first += kSize) {
            m_packet.setCamera(chunk.ray, chunk.camera.time, first);
            tracer.intersect(m_packet, std::min(kSize, count - first), true);
            tracer.hits(m_packet, chunk.hit, first);
        }
    }
}

} // namespace strobe
