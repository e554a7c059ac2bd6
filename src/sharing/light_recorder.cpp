#include "sharing/light_recorder.h"

#include "sharing/emission_refinement.h"

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
    constexpr float kMaxIndex = 1 << 30;
    const float limited = std::min(std::max(q, -kMaxIndex), kMaxIndex);
    const int32_t truncated = int32_t(limited);
    index = truncated - (float(truncated) > limited ? 1 : 0);
    offset = limited - float(index);
}

/// Writes the cells of points whose edges are next to `size`, in scene units.
STROBE_TARGET_CLONES void findCells(const V3SoA& p, const V3SoA& n, const float* size, int count,
                                    CellSoA& out) {
    constexpr int kExponentBias = 127, kMantissaBits = 23, kMaxLevel = 60;
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

} // namespace

void RecordingWorker::plan(const VisibilityBatch& batch, ShadingRequests& requests) {
    requestForEach(m_scene, batch, requests);
    if (m_scene.needsFootprint()) // the requests have their cones
        return;
    for (size_t c = 0; c < requests.chunks(); ++c) {
        RequestSoA& chunk = requests.chunk(c);
        m_scene.camera().coneSoA(batch.samples.chunk(c).camera.film, requests.chunkSize(c), chunk.width,
                                 chunk.spread);
    }
}

void RecordingWorker::observe(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                              std::span<const FirstVertex> vertices) {
    m_recorder.record(batch, radiance, vertices);
    if (!m_refinement || !batch.filmSlice.contains(0))
        return;
    for (const PixelRef& pixel : batch.pixels)
        if (m_refinement->refines(pixel))
            m_out.addRefined(m_out.indexOf(pixel), m_refinement->trace(pixel));
}

/// One half of the samples of a pixel.
struct LightRecorder::HalfPixel {
    uint32_t pixel;
    int half;
    uint32_t first, end;   ///< samples of the batch
    uint32_t endOfQuarter; ///< number of a sample in its pixel
    size_t firstUse = 0;   ///< in m_uses
};

/// The samples of one chunk of the batch.
struct LightRecorder::Chunk {
    V3SoA p, n;                        ///< at rest; see findRestPoints
    alignas(64) float size[kSoAWidth]; ///< of the cells
    CellSoA cells;
};

LightRecorder::LightRecorder(const Scene& scene, RecordedLight& out, float cellSize, float clamp,
                             const RareLimits& rareLimits)
    : m_scene(scene), m_out(out), m_cellSize(cellSize), m_clamp(clamp), m_rareLimits(rareLimits) {}

LightRecorder::~LightRecorder() = default;

bool LightRecorder::isStatic(const Hit& hit) const {
    const PlacedShape& placed = m_scene.geometry(hit).placed;
    return placed.isStatic() &&
           (hit.instance == kNone || m_scene.instances()[hit.instance].motion->isStatic());
}

/// Writes the positions and the normals, on the side of the viewer, at shutter fraction 0.
void LightRecorder::findRestPoints(std::span<const FirstVertex> vertices, V3SoA& p, V3SoA& n) const {
    alignas(64) static constexpr float kAtRest[kSoAWidth] = {};
    HitSoA moving;
    int source[kSoAWidth], count = 0;
    for (size_t i = 0; i < vertices.size(); ++i) {
        const FirstVertex& vertex = vertices[i];
        if (!vertex.hit)
            continue;
        if (isStatic(vertex.hit)) {
            p.set(int(i), vertex.p);
            n.set(int(i), vertex.n);
        } else {
            moving.set(count, vertex.hit);
            source[count++] = int(i);
        }
    }
    if (count == 0)
        return;
    SurfaceSoA rest;
    m_scene.rawSurfaces(moving, kAtRest, count, rest);
    for (int k = 0; k < count; ++k) {
        RawSurfacePoint point = rest.at(k);
        point.finish();
        p.set(source[k], point.p);
        n.set(source[k], vertices[size_t(source[k])].isFront ? point.ng : -point.ng);
    }
}

void LightRecorder::record(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                           std::span<const FirstVertex> vertices) {
    m_chunks.resize(batch.samples.chunks());
    for (size_t c = 0; c < m_chunks.size(); ++c)
        findRestPoints(vertices.subspan(c * kSoAWidth, size_t(batch.samples.chunkSize(c))), m_chunks[c].p,
                       m_chunks[c].n);
    findHalves(batch);
    for (const HalfPixel& half : m_halves)
        setCellSize(half, vertices);
    for (size_t c = 0; c < m_chunks.size(); ++c)
        findCells(m_chunks[c].p, m_chunks[c].n, m_chunks[c].size, batch.samples.chunkSize(c),
                  m_chunks[c].cells);
    for (HalfPixel& half : m_halves)
        recordHalf(half, batch, radiance, vertices);
    flush();
}

/// Writes the intervals of samples that are halves of pixels to m_halves.
void LightRecorder::findHalves(const VisibilityBatch& batch) {
    const uint32_t middle = (batch.samplesPerPixel + 1) / 2;
    m_halves.clear();
    uint32_t lastPixel = 0;
    for (uint32_t i = 0; i < batch.samples.size(); ++i) {
        const VisibilitySoA& samples = batch.samples.chunk(i / kSoAWidth);
        const uint32_t lane = i % kSoAWidth, index = samples.index[lane];
        if (!batch.filmSlice.contains(index))
            continue;
        const int half = index < middle ? 0 : 1;
        if (m_halves.empty() || samples.pixel[lane] != lastPixel || half != m_halves.back().half) {
            lastPixel = samples.pixel[lane];
            const PixelRef& pixel = batch.pixels[lastPixel];
            m_halves.push_back({m_out.indexOf(pixel), half, i, i,
                                half == 0 ? (middle + 1) / 2 : (middle + batch.samplesPerPixel + 1) / 2});
        }
        m_halves.back().end = i + 1;
    }
}

/// Sets the sizes of the cells of a half: the width of the pixel's cone times the size in pixels, or half the
/// mean distance between consecutive samples on a surface, if they are spread by a lens or by motion.
void LightRecorder::setCellSize(const HalfPixel& half, std::span<const FirstVertex> vertices) {
    float sum = 0;
    int count = 0;
    const auto chunkOf = [&](uint32_t i) -> Chunk& { return m_chunks[i / kSoAWidth]; };
    for (uint32_t i = half.first + 1; i < half.end; ++i) {
        const Hit &hit = vertices[i].hit, &last = vertices[i - 1].hit;
        if (!hit || hit.geometry != last.geometry || hit.instance != last.instance)
            continue;
        sum += length(chunkOf(i).p.at(int(i % kSoAWidth)) - chunkOf(i - 1).p.at(int((i - 1) % kSoAWidth)));
        ++count;
    }
    const float spread = count > 0 ? sum / float(count) : 0;
    for (uint32_t i = half.first; i < half.end; ++i)
        chunkOf(i).size[i % kSoAWidth] = std::max(vertices[i].coneWidth * m_cellSize, spread / 2);
}

void LightRecorder::recordHalf(HalfPixel& half, const VisibilityBatch& batch, std::span<const Rgb> radiance,
                               std::span<const FirstVertex> vertices) {
    HalfPixelSums sums;
    half.firstUse = m_uses.size();
    for (uint32_t i = half.first; i < half.end; ++i) {
        const VisibilitySoA& samples = batch.samples.chunk(i / kSoAWidth);
        const uint32_t lane = i % kSoAWidth;
        if (!isValid(radiance[i] * samples.weight[lane]))
            continue; // neither is it in the film
        const float scale = clampScale(radiance[i]);
        sums.add(vertices[i].emitted, radiance[i], samples.weight[lane] * scale);
        recordVertex(vertices[i], i, samples.weight[lane], scale, half, sums,
                     samples.index[lane] < half.endOfQuarter);
        if (samples.index[lane] < half.endOfQuarter)
            sums.finishQuarter();
    }
    m_out.pixel(half.pixel, half.half).add(sums);
}

/// Returns the factor by which the film scales a sample.
float LightRecorder::clampScale(const Rgb& radiance) const {
    const float maxChannel = std::max({radiance.x, radiance.y, radiance.z});
    return m_clamp > 0 && maxChannel > m_clamp ? m_clamp / maxChannel : 1;
}

/// Records the vertex of sample i of the batch, whose light is multiplied by `scale`.
void LightRecorder::recordVertex(const FirstVertex& vertex, uint32_t i, float weight, float scale,
                                 const HalfPixel& half, HalfPixelSums& sums, bool isInQuarter) {
    if (!vertex.hit || !(vertex.coneWidth > 0))
        return;
    Rgb light[kParts] = {irradiance(vertex.direct, vertex.albedo) * scale,
                         irradiance(vertex.indirect, vertex.albedo) * scale};
    const Chunk& chunk = m_chunks[i / kSoAWidth];
    const uint32_t cell = findCell(chunk.cells.at(vertex.hit, int(i % kSoAWidth)));
    for (int part = 0; part < kParts; ++part) {
        const float limit = m_rareLimits.of[part], brightness = maxComponent(vertex.albedo * light[part]);
        if (brightness > limit) {
            const Rgb rare = light[part] * (1 - limit / brightness);
            light[part] -= rare;
            m_rare.push_back({half.pixel, cell, uint8_t(part), uint8_t(half.half), isInQuarter, rare,
                              vertex.albedo * weight});
        }
        sums.light[part] += vertex.albedo * light[part] * weight;
    }
    CellSums& cellSums = m_cells[cell];
    const V3f offset = chunk.cells.offset.at(int(i % kSoAWidth)) * float(1 << CellSums::kPositionBits);
    const V3f n = chunk.n.at(int(i % kSoAWidth)) * float(1 << CellSums::kNormalBits);
    for (int k = 0; k < 3; ++k) {
        cellSums.p[k] += int32_t(offset[k]);
        cellSums.n[k] += int32_t(n[k]);
    }
    for (int part = 0; part < kParts; ++part)
        cellSums.light[part][half.half].add(light[part], 1);
    CellUse* use = m_uses.empty() ? nullptr : &m_uses.back();
    if (m_uses.size() == half.firstUse || use->cell != cell)
        use = &findUse(half, cell);
    use->albedo += vertex.albedo * weight;
}

CellUse& LightRecorder::findUse(const HalfPixel& half, uint32_t cell) {
    for (size_t u = half.firstUse; u < m_uses.size(); ++u)
        if (m_uses[u].cell == cell)
            return m_uses[u];
    return m_uses.emplace_back(CellUse{half.pixel, cell & 0x7fffffffu, uint32_t(half.half) & 1, Rgb(0)});
}

/// Returns the index in m_cells of a cell, added if necessary.
uint32_t LightRecorder::findCell(const CellId& id) {
    if (!m_cells.empty() && m_cells[m_lastCell].id == id)
        return m_lastCell;
    m_lastCell = m_cellIndices.findOrInsert(id.hash(), uint32_t(m_cells.size()));
    if (m_lastCell == m_cells.size())
        m_cells.emplace_back().id = id;
    return m_lastCell;
}

void LightRecorder::flush() {
    std::vector<uint32_t> handles(m_cells.size());
    for (size_t i = 0; i < m_cells.size(); ++i)
        handles[i] = m_out.cells.add(m_cells[i]);
    for (CellUse& use : m_uses)
        use.cell = handles[use.cell] & 0x7fffffffu;
    for (RareSample& rare : m_rare)
        rare.cell = handles[rare.cell];
    m_out.addUses(m_uses);
    m_out.addRare(m_rare);
    m_rare.clear();
    m_cells.clear();
    m_uses.clear();
    m_cellIndices.clear();
    m_lastCell = 0;
}

} // namespace strobe
