#include "sharing/light_recorder.h"

#include "sharing/emission_refinement.h"

#include <algorithm>
#include <bit>

namespace strobe {

namespace {

/// An albedo below this is black: it carries no light to other points.
constexpr float kBlack = 1e-4f;

/// Returns whether the film adds a sample with this weighted value: see PixelAccumulator.
bool isValid(const Rgb& value) {
    constexpr float kMax = float(PixelAccumulator::kMaxValue);
    return std::abs(value.x) < kMax && std::abs(value.y) < kMax && std::abs(value.z) < kMax;
}

float ratio(float light, float albedo) { return albedo > kBlack ? light / albedo : 0; }
Rgb irradiance(const Rgb& light, const Rgb& albedo) {
    return {ratio(light.x, albedo.x), ratio(light.y, albedo.y), ratio(light.z, albedo.z)};
}

/// The cells of points: CellId without `surface`, and the offset of each point from the corner of its cell in
/// edges of the cell.
struct CellSoA {
    alignas(64) int32_t x[kSoAWidth], y[kSoAWidth], z[kSoAWidth], level[kSoAWidth], face[kSoAWidth];
    V3SoA offset;

    CellId at(const Hit& hit, int i) const {
        return {uint64_t(hit.instance) << 32 | hit.geometry,
                x[i],
                y[i],
                z[i],
                int16_t(level[i]),
                uint16_t(face[i])};
    }
};

/// Writes the largest integer not above q, limited to ±2^30, and what is left of q, at most 1.
STROBE_FORCE_INLINE void splitCoordinate(float q, int32_t& index, float& offset) {
    constexpr float kMaxIndex = float(CellId::kMaxIndex);
    const float limited = std::min(kMaxIndex, std::max(-kMaxIndex, q)); // NaN is a limit, too
    const int32_t truncated = int32_t(limited);
    index = truncated - (float(truncated) > limited ? 1 : 0);
    offset = limited - float(index);
}

/// Writes the cells of points whose edges are next to `size`, in scene units.
STROBE_TARGET_CLONES void findCells(const V3SoA& p, const V3SoA& n, const float* size, int count,
                                    CellSoA& out) {
    constexpr int kExponentBias = 127, kMantissaBits = 23, kMaxLevel = CellId::kMaxLevel;
    STROBE_IVDEP
    for (int i = 0; i < count; ++i) {
        const int exponent =
            (std::bit_cast<int32_t>(size[i] * std::sqrt(2.f)) >> kMantissaBits) - kExponentBias;
        const int level = std::min(std::max(exponent, -kMaxLevel), kMaxLevel);
        const float inverseEdge = std::bit_cast<float>((kExponentBias - level) << kMantissaBits);
        splitCoordinate(p.x[i] * inverseEdge, out.x[i], out.offset.x[i]);
        splitCoordinate(p.y[i] * inverseEdge, out.y[i], out.offset.y[i]);
        splitCoordinate(p.z[i] * inverseEdge, out.z[i], out.offset.z[i]);
        const float ax = std::abs(n.x[i]), ay = std::abs(n.y[i]), az = std::abs(n.z[i]);
        const bool isX = ax >= ay && ax >= az, isY = ay >= az;
        const float notX = isY ? n.y[i] : n.z[i];
        const int axis = isX ? 0 : isY ? 1 : 2;
        out.level[i] = level;
        out.face[i] = 2 * axis + ((isX ? n.x[i] : notX) < 0 ? 1 : 0);
    }
}

std::span<const FirstVertex> chunkOf(std::span<const FirstVertex> vertices, size_t chunk) {
    const size_t first = chunk * kSoAWidth;
    return vertices.subspan(first, std::min<size_t>(kSoAWidth, vertices.size() - first));
}

} // namespace

/// The samples of one chunk of requests.
struct LightRecorder::Chunk {
    V3SoA p, n;                        ///< at rest; see findRestPoints
    alignas(64) float size[kSoAWidth]; ///< of the cells
    CellSoA cells;
};

LightRecorder::LightRecorder(const Scene& scene, float cellSize, float clamp, LightParts parts,
                             const RareLimits& rareLimits)
    : m_scene(scene), m_spread(scene), m_cellSize(cellSize), m_clamp(clamp), m_parts(parts),
      m_rareLimits(rareLimits), m_tile(parts) {}

LightRecorder::~LightRecorder() = default;

/// Writes the positions and the normals, on the side of the viewer, at shutter fraction 0.
void LightRecorder::findRestPoints(std::span<const FirstVertex> vertices, V3SoA& p, V3SoA& n) const {
    MovingHits moving;
    for (size_t i = 0; i < vertices.size(); ++i) {
        const FirstVertex& vertex = vertices[i];
        if (!vertex.hit)
            continue;
        if (isStatic(m_scene, vertex.hit)) {
            p.set(int(i), vertex.p);
            n.set(int(i), vertex.n);
        } else {
            moving.add(vertex.hit, int(i));
        }
    }
    moving.forEachAtRest(m_scene, [&](int i, const RawSurfacePoint& point) {
        p.set(i, point.p);
        n.set(i, vertices[size_t(i)].isFront ? point.ng : -point.ng);
    });
}

void LightRecorder::record(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                           std::span<const FirstVertex> vertices) {
    m_samples = batch.filmSlice;
    m_chunks.resize((vertices.size() + kSoAWidth - 1) / kSoAWidth);
    for (size_t c = 0; c < m_chunks.size(); ++c)
        findRestPoints(chunkOf(vertices, c), m_chunks[c].p, m_chunks[c].n);
    setCellSizes(batch, vertices);
    for (size_t c = 0; c < m_chunks.size(); ++c)
        findCells(m_chunks[c].p, m_chunks[c].n, m_chunks[c].size, int(chunkOf(vertices, c).size()),
                  m_chunks[c].cells);
    for (uint32_t pixel = 0; pixel < batch.pixels.size(); ++pixel)
        recordPixel(batch, pixel, radiance, vertices);
}

/// Sets the sizes of the cells of each sample: the width of its cone times the size in pixels, or times half
/// the spread of its pixel, if that is larger: if a lens, motion or a grazing angle spreads the samples.
void LightRecorder::setCellSizes(const VisibilityBatch& batch, std::span<const FirstVertex> vertices) {
    const uint32_t count = batch.filmSlice.count();
    for (uint32_t pixel = 0; pixel < batch.pixels.size(); ++pixel) {
        const float size = std::max(m_cellSize, m_spread.of(batch, pixel) / 2);
        for (uint32_t i = pixel * count; i < (pixel + 1) * count; ++i)
            m_chunks[i / kSoAWidth].size[i % kSoAWidth] = vertices[i].coneWidth * size;
    }
}

/// Records the samples of a pixel, quarter by quarter. The samples' numbers in the pixel divide them.
void LightRecorder::recordPixel(const VisibilityBatch& batch, uint32_t pixel, std::span<const Rgb> radiance,
                                std::span<const FirstVertex> vertices) {
    const uint32_t all = batch.samplesPerPixel, middle = (all + 1) / 2;
    const uint32_t ends[kHalves * kQuarters] = {(middle + 1) / 2, middle, (middle + all + 1) / 2, all};
    const SampleSlice& slice = batch.filmSlice;
    const uint32_t firstRequest = pixel * slice.count(), firstSample = batch.sampleIndex(pixel, slice.first);
    m_pixel.clear();
    for (uint32_t k = 0, number = slice.first; k < kHalves * kQuarters; ++k)
        for (; number < std::min(ends[k], slice.end); ++number) {
            const uint32_t request = firstRequest + number - slice.first;
            const uint32_t sample = firstSample + number - slice.first;
            const float weight = batch.samples.chunk(sample / kSoAWidth).weight[sample % kSoAWidth];
            recordSample(vertices[request], radiance[request], request, weight, k);
        }
    m_tile.addPixel(batch.pixels[pixel].x, batch.pixels[pixel].y, m_pixel);
}

/// Returns the factor by which the film scales a sample.
float LightRecorder::clampScale(const Rgb& radiance) const {
    const float maxChannel = std::max({radiance.x, radiance.y, radiance.z});
    return m_clamp > 0 && maxChannel > m_clamp ? m_clamp / maxChannel : 1;
}

/// Records a sample of a quarter of the pixel, 0 … 3.
void LightRecorder::recordSample(const FirstVertex& vertex, const Rgb& radiance, uint32_t request,
                                 float weight, uint32_t quarter) {
    if (!isValid(radiance * weight))
        return; // neither is it in the film
    const uint32_t halfIndex = quarter / kQuarters;
    HalfLight& half = m_pixel.halves[halfIndex];
    HalfLight::Quarter& sums = half.quarters[quarter % kQuarters];
    const float scale = clampScale(radiance), scaledWeight = weight * scale;
    ++sums.count;
    const double v = double(scaledWeight * (radiance.x + radiance.y + radiance.z) / 3);
    half.v.add(v);
    if (const Rgb emitted = vertex.emitted * scaledWeight; !isBlack(emitted)) {
        half.emitted.add(emitted);
        const double e = double((emitted.x + emitted.y + emitted.z) / 3);
        half.ee.add(e * e);
        half.ve.add(e * v);
    }
    if (!vertex.hit || !(vertex.coneWidth > 0))
        return;
    Rgb light[kParts] = {Rgb(0), Rgb(0)};
    if (m_parts.has(LightPart::Direct))
        light[int(LightPart::Direct)] = irradiance(vertex.direct, vertex.albedo) * scale;
    if (m_parts.has(LightPart::Indirect))
        light[int(LightPart::Indirect)] = irradiance(vertex.indirect, vertex.albedo) * scale;
    const uint32_t cell = findCell(vertex, request);
    const Rgb albedo = vertex.albedo * weight;
    for (int part = 0; part < kParts; ++part) {
        if (!m_parts.has(LightPart(part)))
            continue;
        if (const Rgb rare = takeRareLight(vertex, part, light[part]); !isBlack(rare))
            half.rare.push_back({cell, uint8_t(part), quarter % kQuarters == 0, rare, albedo});
        sums.light[part].add(albedo * light[part]);
    }
    recordInCell(cell, light, request, halfIndex);
    if (half.uses.empty() || half.uses.back().cell != cell)
        findUse(half.uses, cell).add(albedo);
    else
        half.uses.back().add(albedo);
}

/// Returns the light above the limit, and removes it from the light of a part, divided by the albedo.
Rgb LightRecorder::takeRareLight(const FirstVertex& vertex, int part, Rgb& light) const {
    const float limit = m_rareLimits.of[part], brightness = maxComponent(vertex.albedo * light);
    if (!(brightness > limit))
        return Rgb(0);
    const Rgb rare = light * (1 - limit / brightness);
    light -= rare;
    return rare;
}

/// Returns the index in the tile of the cell of a request.
uint32_t LightRecorder::findCell(const FirstVertex& vertex, uint32_t request) {
    return m_tile.findCell(m_chunks[request / kSoAWidth].cells.at(vertex.hit, int(request % kSoAWidth)));
}

/// Adds the light of a request to its cell.
void LightRecorder::recordInCell(uint32_t index, const Rgb (&light)[kParts], uint32_t request,
                                 uint32_t half) {
    const Chunk& chunk = m_chunks[request / kSoAWidth];
    const int lane = int(request % kSoAWidth);
    CellSums& cell = m_tile.cell(index);
    const V3f offset = chunk.cells.offset.at(lane) * float(1 << CellSums::kPositionBits);
    const V3f n = chunk.n.at(lane);
    for (int k = 0; k < 3; ++k) {
        cell.p[k] += int32_t(offset[k]);
        // The normal of a surface that is degenerate at rest is NaN.
        cell.n[k] += int32_t(std::max(-1.f, std::min(1.f, n[k])) * float(1 << CellSums::kNormalBits));
    }
    ++cell.count[half];
    for (int part = 0; part < kParts; ++part)
        if (m_parts.has(LightPart(part)))
            cell.light[part][half].add(light[part]);
}

CellUse& LightRecorder::findUse(std::vector<CellUse>& uses, uint32_t cell) {
    for (CellUse& use : uses)
        if (use.cell == cell)
            return use;
    uses.emplace_back().cell = cell;
    return uses.back();
}

void RecordingWorker::plan(const VisibilityBatch& batch, ShadingRequests& requests) {
    if (batch.filmSlice == batch.slice) {
        requestForEach(m_scene, batch, requests);
    } else {
        for (const VisibilitySample& sample : batch.samples)
            if (batch.filmSlice.contains(sample.index))
                requests.push_back(requestFor(m_scene, batch, sample));
    }
    if (!m_scene.needsFootprint()) // else the requests have their cones
        setCones(batch, requests);
}

void RecordingWorker::observe(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                              std::span<const FirstVertex> vertices) {
    m_hasObserved = true;
    m_recorder.record(batch, radiance, vertices);
    if (!m_refinement || !batch.filmSlice.contains(0)) // one slice of a pixel refines it
        return;
    for (const PixelRef& pixel : batch.pixels)
        if (m_refinement->refines(pixel))
            m_recorder.addEmission(pixel, m_refinement->trace(pixel));
}

void RecordingWorker::setCones(const VisibilityBatch& batch, ShadingRequests& requests) const {
    for (size_t c = 0; c < requests.chunks(); ++c) {
        RequestSoA& chunk = requests.chunk(c);
        V2SoA film;
        for (int i = 0; i < requests.chunkSize(c); ++i) {
            const uint32_t sample = chunk.sample[i];
            film.set(i, batch.samples.chunk(sample / kSoAWidth).camera.film.at(int(sample % kSoAWidth)));
        }
        m_scene.camera().coneSoA(film, requests.chunkSize(c), chunk.width, chunk.spread);
    }
}

std::span<const Rgb> RecordingWorker::resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                              std::span<Rgb> values) {
    if (batch.filmSlice == batch.slice)
        return shaded; // request i is that of sample i
    std::fill(values.begin(), values.end(), Rgb(0));
    const uint32_t count = batch.filmSlice.count();
    for (uint32_t i = 0; i < shaded.size(); ++i)
        values[batch.sampleIndex(i / count, batch.filmSlice.first) + i % count] = shaded[i];
    return values;
}

} // namespace strobe
