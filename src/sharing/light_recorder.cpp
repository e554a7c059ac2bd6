#include "sharing/light_recorder.h"

#include "sharing/emission/emission_refinement.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace strobe {

namespace {

/// The cells of points, and the offset of each point from the corner of its cell, in units of CellSums.
struct CellSoA {
    uint64_t surface[kSoAWidth]; ///< see SurfaceIds
    alignas(64) int32_t x[kSoAWidth], y[kSoAWidth], z[kSoAWidth], level[kSoAWidth], face[kSoAWidth];
    alignas(64) int32_t offsets[CellSlot::kOffsets][kSoAWidth];

    CellId at(int i) const { return {surface[i], x[i], y[i], z[i], int16_t(level[i]), uint16_t(face[i])}; }
};

/// Writes the largest integer not above q, limited to ±2^30, and what is left of q, at most 1, in units.
STROBE_FORCE_INLINE void splitCoordinate(float q, int32_t& index, int32_t& offset) {
    constexpr float kMaxIndex = float(CellId::kMaxIndex);
    const float limited = std::min(kMaxIndex, std::max(-kMaxIndex, q)); // NaN is a limit, too
    const int32_t truncated = int32_t(limited);
    index = truncated - (float(truncated) > limited ? 1 : 0);
    offset = int32_t((limited - float(index)) * float(1 << CellSums::kPositionBits));
}

/// Returns a component of a normal in units. That of a surface that is degenerate at rest is NaN.
STROBE_FORCE_INLINE int32_t normalUnits(float n) {
    return int32_t(std::max(-1.f, std::min(1.f, n)) * float(1 << CellSums::kNormalBits));
}

/// Writes the cells of points whose edges are next to `size`, in scene units. `n`: geometric normals, `ns`:
/// shading normals.
STROBE_TARGET_CLONES void findCells(const V3SoA& p, const V3SoA& n, const V3SoA& ns, const float* size,
                                    int count, CellSoA& out) {
    constexpr int kExponentBias = 127, kMantissaBits = 23, kMaxLevel = CellId::kMaxLevel;
    STROBE_IVDEP
    for (int i = 0; i < count; ++i) {
        const int exponent =
            (std::bit_cast<int32_t>(size[i] * std::sqrt(2.f)) >> kMantissaBits) - kExponentBias;
        const int level = std::min(std::max(exponent, -kMaxLevel), kMaxLevel);
        const float inverseEdge = std::bit_cast<float>((kExponentBias - level) << kMantissaBits);
        splitCoordinate(p.x[i] * inverseEdge, out.x[i], out.offsets[0][i]);
        splitCoordinate(p.y[i] * inverseEdge, out.y[i], out.offsets[1][i]);
        splitCoordinate(p.z[i] * inverseEdge, out.z[i], out.offsets[2][i]);
        const float ax = std::abs(n.x[i]), ay = std::abs(n.y[i]), az = std::abs(n.z[i]);
        const bool isX = ax >= ay && ax >= az, isY = ay >= az;
        const float notX = isY ? n.y[i] : n.z[i];
        const int axis = isX ? 0 : isY ? 1 : 2;
        out.level[i] = level;
        out.face[i] = 2 * axis + ((isX ? n.x[i] : notX) < 0 ? 1 : 0);
        out.offsets[3][i] = normalUnits(ns.x[i]);
        out.offsets[4][i] = normalUnits(ns.y[i]);
        out.offsets[5][i] = normalUnits(ns.z[i]);
    }
}

} // namespace

/// The samples of one chunk of requests.
struct LightRecorder::Chunk {
    V3SoA p, n, ns;                    ///< at rest; see findRestPoints
    alignas(64) float size[kSoAWidth]; ///< of the cells
    CellSoA cells;
    LightSoA light;
    LightUnits units;
    Rgb emitted[kSoAWidth]; ///< FirstVertex::emitted
    int count;
    bool hasEmission;
};

LightRecorder::LightRecorder(const Scene& scene, float cellSize, float clamp, LightParts parts,
                             const RareLimits& rareLimits, FrameLight& frame)
    : m_scene(scene), m_surfaceIds(scene.surfaceIds()), m_spread(scene), m_cellSize(cellSize),
      m_parts(parts), m_limits{clamp, rareLimits}, m_frame(frame), m_tile(parts) {}

LightRecorder::~LightRecorder() = default;

void LightRecorder::beginTile(const Film& film) {
    m_hasRecord = !m_frame.beginTile(film);
    m_tile.clear();
    m_lists.clear();
}

void LightRecorder::addEmission(const PixelRef& pixel, const PixelAccumulator& sum) {
    if (m_hasRecord)
        m_tile.addEmission(pixel.x, pixel.y, sum);
    else
        m_lists.refined.push_back({m_frame.indexOf(pixel.x, pixel.y), sum});
}

void LightRecorder::finishTile(const PixelBounds& tile, Film& film) {
    if (m_hasRecord)
        film.records().add(m_tile.record(tile, m_samples));
    else
        m_frame.add(m_tile.cells(), m_lists);
}

/// Writes the positions, the geometric normals and the shading normals at shutter fraction 0. The normals are
/// on the side of the viewer.
void LightRecorder::findRestPoints(std::span<const FirstVertex> vertices, V3SoA& p, V3SoA& n,
                                   V3SoA& ns) const {
    MovingHits moving;
    StaticHits statics(m_scene);
    for (size_t i = 0; i < vertices.size(); ++i) {
        const FirstVertex& vertex = vertices[i];
        if (!vertex.hit || statics.contain(vertex.hit)) {
            p.set(int(i), vertex.p);
            n.set(int(i), vertex.n);
            ns.set(int(i), vertex.ns);
        } else {
            moving.add(vertex.hit, int(i));
        }
    }
    moving.forEachAtRest(m_scene, [&](int i, const RawSurfacePoint& point) {
        p.set(i, point.p);
        const FirstVertex& vertex = vertices[size_t(i)];
        n.set(i, vertex.isFront ? point.ng : -point.ng);
        ns.set(i, shadingNormalAtRest(vertex, point));
    });
}

/// Copies what the shader found.
void LightRecorder::gatherLight(std::span<const FirstVertex> vertices, std::span<const Rgb> radiance,
                                Chunk& chunk) const {
    chunk.hasEmission = false;
    for (size_t k = 0; k < vertices.size(); ++k) {
        const FirstVertex& vertex = vertices[k];
        const int i = int(k);
        chunk.cells.surface[i] = vertex.hit ? m_surfaceIds.of(vertex.hit) : 0;
        if (vertex.hit && vertex.hasMappedNormal)
            chunk.cells.surface[i] = surfaceOfTilt(chunk.cells.surface[i], chunk.n.at(i), chunk.ns.at(i));
        chunk.light.radiance.set(i, radiance[k]);
        chunk.light.albedo.set(i, vertex.albedo);
        chunk.light.parts[int(LightPart::Direct)].set(i, vertex.direct);
        chunk.light.parts[int(LightPart::Indirect)].set(i, vertex.indirect);
        chunk.light.hasVertex[i] = vertex.hit && vertex.coneWidth > 0;
        chunk.emitted[i] = vertex.emitted;
        chunk.hasEmission |= !isBlack(vertex.emitted);
    }
    for (int part = 0; part < kParts; ++part)
        if (!m_parts.has(LightPart(part)))
            std::memset(&chunk.light.parts[part], 0, sizeof(RgbSoA));
}

void LightRecorder::record(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                           std::span<const FirstVertex> vertices) {
    m_samples = {batch.filmSlice.first / batch.sampleFactor, batch.filmSlice.end / batch.sampleFactor};
    m_chunks.resize((vertices.size() + kSoAWidth - 1) / kSoAWidth);
    for (size_t c = 0; c < m_chunks.size(); ++c) {
        Chunk& chunk = m_chunks[c];
        const size_t first = c * kSoAWidth;
        chunk.count = int(std::min<size_t>(kSoAWidth, vertices.size() - first));
        const auto ofChunk = vertices.subspan(first, size_t(chunk.count));
        findRestPoints(ofChunk, chunk.p, chunk.n, chunk.ns);
        gatherLight(ofChunk, radiance.subspan(first, size_t(chunk.count)), chunk);
    }
    setPixelData(batch, vertices);
    for (Chunk& chunk : m_chunks) {
        findCells(chunk.p, chunk.n, chunk.ns, chunk.size, chunk.count, chunk.cells);
        findLightUnits(chunk.light, m_limits, chunk.count, chunk.units);
    }
    for (uint32_t pixel = 0; pixel < batch.pixels.size(); ++pixel)
        recordPixel(batch, pixel);
}

/// Sets the filter weights and the sizes of the cells of each sample. A size is the width of the sample's
/// cone times the size in pixels, or times half the spread of its pixel, if that is larger: if a lens, motion
/// or a grazing angle spreads the samples.
void LightRecorder::setPixelData(const VisibilityBatch& batch, std::span<const FirstVertex> vertices) {
    const uint32_t count = batch.filmSlice.count();
    for (uint32_t pixel = 0; pixel < batch.pixels.size(); ++pixel) {
        const float size = std::max(m_cellSize, m_spread.of(batch, pixel) / 2);
        uint32_t sample = batch.sampleIndex(pixel, batch.filmSlice.first);
        for (uint32_t i = pixel * count; i < (pixel + 1) * count; ++i, ++sample) {
            Chunk& chunk = m_chunks[i / kSoAWidth];
            const uint32_t lane = i % kSoAWidth;
            chunk.size[lane] = vertices[i].coneWidth * size;
            chunk.light.weight[lane] = batch.samples.chunk(sample / kSoAWidth).weight[sample % kSoAWidth];
        }
    }
}

/// Records the samples of a pixel, quarter by quarter. The samples' numbers in the pixel divide them.
void LightRecorder::recordPixel(const VisibilityBatch& batch, uint32_t pixel) {
    const uint32_t all = batch.samplesPerPixel, middle = (all + 1) / 2;
    const uint32_t ends[kHalves * kQuarters] = {(middle + 1) / 2, middle, (middle + all + 1) / 2, all};
    const SampleSlice& slice = batch.filmSlice;
    const uint32_t firstRequest = pixel * slice.count();
    m_pixel.clear();
    for (uint32_t k = 0, number = slice.first; k < kHalves * kQuarters; ++k) {
        const uint32_t quarterEnd = std::min(ends[k], slice.end);
        while (number < quarterEnd) { // part by part of chunks
            const uint32_t request = firstRequest + number - slice.first, lane = request % kSoAWidth;
            const uint32_t count = std::min(quarterEnd - number, kSoAWidth - lane);
            recordSamples(m_chunks[request / kSoAWidth], int(lane), int(lane + count), k);
            number += count;
        }
        if (k % kQuarters == kQuarters - 1)
            emptySlots(k / kQuarters);
    }
    const PixelRef& at = batch.pixels[pixel];
    if (m_hasRecord)
        m_tile.addPixel(at.x, at.y, m_pixel);
    else
        m_frame.setPixel(at.x, at.y, m_pixel, m_lists);
}

/// Records the samples first … end - 1 of a chunk, which are in a quarter of the pixel, 0 … 3.
void LightRecorder::recordSamples(const Chunk& chunk, int first, int end, uint32_t quarter) {
    HalfLight& half = m_pixel.halves[quarter / kQuarters];
    HalfLight::Quarter& sums = half.quarters[quarter % kQuarters];
    const LightUnits& units = chunk.units;
    int64_t reflected[LightUnits::kReflectedCount] = {};
    uint32_t isSpecial = 0;
    for (int i = first; i < end; ++i) {
        sums.count += units.isCounted[i];
        sums.negativeCount += chunk.light.weight[i] < 0 ? units.isCounted[i] : 0;
        isSpecial |= units.isSpecial[i];
        for (int k = 0; k < LightUnits::kReflectedCount; ++k)
            reflected[k] += units.of[LightUnits::kReflected + k][i];
        if (units.isRecorded[i])
            recordInCell(chunk, i, quarter / kQuarters);
    }
    for (int part = 0; part < kParts; ++part)
        addUnits(&reflected[3 * part], sums.light[part]);
    half.v.add(FixedPointSum(reflected[LightUnits::kValue - LightUnits::kReflected]));
    if (chunk.hasEmission)
        recordEmission(chunk, first, end, half);
    if (isSpecial)
        for (int i = first; i < end; ++i)
            if (units.isSpecial[i])
                recordSpecial(chunk, i, quarter);
}

/// Adds three quantities.
void LightRecorder::addUnits(const int64_t* units, RgbSum& sum) {
    for (int c = 0; c < 3; ++c)
        sum.channels[c].add(FixedPointSum(units[c]));
}

void LightRecorder::recordEmission(const Chunk& chunk, int first, int end, HalfLight& half) const {
    for (int i = first; i < end; ++i) {
        if (isBlack(chunk.emitted[i]) || !chunk.units.isCounted[i])
            continue;
        const SampleLight light(chunk.light, m_limits, i);
        const Rgb emitted = chunk.emitted[i] * (chunk.light.weight[i] * light.scale);
        half.emitted.add(emitted);
        const double e = double((emitted.x + emitted.y + emitted.z) / 3);
        half.ee.add(e * e);
        half.ve.add(e * double(light.value));
    }
}

/// Adds a sample to the slot of its cell.
void LightRecorder::recordInCell(const Chunk& chunk, int i, uint32_t half) {
    CellSlot& slot = findSlot(chunk.cells.at(i));
    for (int k = 0; k < LightUnits::kCellCount; ++k)
        slot.units[k] += chunk.units.of[k][i];
    for (int k = 0; k < CellSlot::kOffsets; ++k)
        slot.offsets[k] += chunk.cells.offsets[k][i];
    if (++slot.count == CellSlot::kMaxCount)
        emptySlots(half);
}

CellSlot& LightRecorder::findSlot(const CellId& id) {
    for (size_t k = m_slots.size(); k-- > 0;)
        if (m_slots[k].id == id)
            return m_slots[k];
    CellSlot& slot = m_slots.emplace_back();
    slot.id = id;
    return slot;
}

/// Adds the slots to the cells of the tile and to a half of the pixel.
void LightRecorder::emptySlots(uint32_t half) {
    for (const CellSlot& slot : m_slots) {
        const uint32_t index = m_tile.findCell(slot.id);
        CellSums& cell = m_tile.cell(index);
        for (int k = 0; k < 3; ++k) {
            cell.p[k] += slot.offsets[k];
            cell.n[k] += slot.offsets[3 + k];
        }
        cell.count[half] += slot.count;
        for (int part = 0; part < kParts; ++part)
            addUnits(&slot.units[LightUnits::kLight + 3 * part], cell.light[part][half]);
        CellUse& use = m_pixel.halves[half].uses.emplace_back();
        use.cell = index;
        std::copy_n(&slot.units[LightUnits::kAlbedo], 3, use.albedo);
    }
    m_slots.clear();
}

/// Adds the light of a sample that exceeds a limit.
void LightRecorder::recordSpecial(const Chunk& chunk, int i, uint32_t quarter) {
    const uint32_t halfIndex = quarter / kQuarters;
    HalfLight& half = m_pixel.halves[halfIndex];
    const SampleLight light(chunk.light, m_limits, i);
    half.v.add(double(light.value));
    if (!chunk.units.isRecorded[i])
        return;
    const uint32_t index = m_tile.findCell(chunk.cells.at(i));
    for (int part = 0; part < kParts; ++part) {
        if (!m_parts.has(LightPart(part)))
            continue;
        if (!isBlack(light.rare[part]))
            half.rare.push_back(
                {index, uint8_t(part), quarter % kQuarters == 0, light.rare[part], light.albedo});
        half.quarters[quarter % kQuarters].light[part].add(light.albedo * light.light[part]);
        m_tile.cell(index).light[part][halfIndex].add(light.light[part]);
    }
}

void RecordingWorker::plan(const VisibilityBatch& batch, ShadingRequests& requests) {
    if (batch.filmSlice == batch.slice) {
        requestForEach(m_scene, batch, requests);
    } else {
        for (const VisibilitySample& sample : batch.samples)
            if (batch.filmSlice.contains(sample.index))
                requests.push_back(requestFor(m_scene, batch, sample));
    }
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

/// Observes the batch if any of its pixels is near one that is refined.
void RecordingWorker::observeEmission(const VisibilityBatch& batch, std::span<const Rgb> radiance) {
    if (std::none_of(batch.pixels.begin(), batch.pixels.end(),
                     [&](const PixelRef& pixel) { return m_refinement->isNear(pixel); }))
        return;
    std::vector<FirstVertex> vertices;
    vertices.reserve(radiance.size());
    for (const VisibilitySample& sample : batch.samples)
        if (batch.filmSlice.contains(sample.index)) {
            vertices.emplace_back();
            vertices.back().emitted = emissionOf(m_scene, sample);
        }
    observe(batch, radiance, vertices);
}

std::span<const Rgb> RecordingWorker::resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                              std::span<Rgb> values) {
    if (!m_records && m_refinement)
        observeEmission(batch, shaded);
    return valuesOf(batch, shaded, values);
}

/// Returns the value of each sample, given those of the requests.
std::span<const Rgb> RecordingWorker::valuesOf(const VisibilityBatch& batch, std::span<const Rgb> shaded,
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
