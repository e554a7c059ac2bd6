#include "sharing/pilots/pair_pilot.h"

#include "core/math/hash.h"

#include <bit>
#include <cmath>

namespace strobe {

namespace {

constexpr uint64_t kSeed = 0x73616d706c6573;
constexpr int kPair = PairPilot::kPair, kBlockSize = PairPilot::kBlockSize;
constexpr int kTileWidth = 128, kTileHeight = 64; ///< larger films cost more page faults
static_assert(kTileWidth % kBlockSize == 0 && kTileHeight % kBlockSize == 0, "a block belongs to one tile");

Rgb clipped(const Rgb& c, float limit) {
    return {std::min(c.x, limit), std::min(c.y, limit), std::min(c.z, limit)};
}

/// Returns the variance of a sample that two samples show, mean of the channels.
float varianceOf(const Rgb& a, const Rgb& b) {
    const Rgb d = a - b;
    return (d.x * d.x + d.y * d.y + d.z * d.z) / 6;
}

/// Adds the variance of some light of two samples, and that of all other light. `limit`: to which the light
/// is clipped.
void addVariance(const Rgb* light, const Rgb* other, float limit, BlockNoise::Light& out) {
    out.variance += varianceOf(clipped(light[0], limit), clipped(light[1], limit));
    out.raw += varianceOf(light[0], light[1]);
    out.clipped += varianceOf(clipped(light[0], 1), clipped(light[1], 1));
    out.other += varianceOf(other[0], other[1]);
}

/// Adds a pair of samples. `limit`: see addVariance.
void addPair(const Rgb* radiance, const FirstVertex* vertices, float limit, BlockNoise& noise) {
    const Rgb sum = radiance[0] + radiance[1];
    if (!std::isfinite(sum.x + sum.y + sum.z))
        return; // invalid samples: the film leaves them out, too
    const Rgb none[kPair] = {Rgb(0), Rgb(0)};
    Rgb vertex[kPair], direct[kPair], emitted[kPair], notDirect[kPair];
    for (int k = 0; k < kPair; ++k) {
        vertex[k] = radiance[k] - vertices[k].emitted;
        direct[k] = vertex[k] - vertices[k].indirect;
        emitted[k] = clipped(vertices[k].emitted, 1); // lamps are left to EmissionRefinement
        notDirect[k] = emitted[k] + clipped(vertices[k].indirect, limit);
        const Rgb c = clipped(radiance[k], 1);
        noise.radiance += (c.x + c.y + c.z) / 3;
        noise.vertices += bool(vertices[k].hit);
    }
    addVariance(radiance, none, limit, noise.all);
    addVariance(vertex, emitted, limit, noise.vertex);
    addVariance(direct, notDirect, limit, noise.direct);
    ++noise.pairs;
}

bool isHit(const SoAVector<VisibilitySoA>& samples, size_t i) {
    return samples.chunk(i / kSoAWidth).hit.geometry[i % kSoAWidth] != kNone;
}

/// Returns the position of the pixel with this rank in the order of a Bayer matrix, whose first pixels are
/// spread evenly over the block.
V2i bayerPosition(int rank) {
    V2i out{0, 0};
    for (int bit = kBlockSize / 2; bit > 0; bit /= 2, rank /= 4) {
        const int y = rank & 1, x = (rank >> 1 & 1) ^ y;
        out.x |= x * bit;
        out.y |= y * bit;
    }
    return out;
}

/// The numbers of pixels per block in renderFirst and in the whole pilot.
struct PixelCounts {
    int first, all;
};

PixelCounts pixelsPerBlock(double samplesPerPixel) {
    constexpr double kShare = 0.02; // the samples of the pilot relative to those of the render
    // Fewer pixels promise less, and plans are refused: two have a third of the gain in an all-diffuse scene.
    constexpr int kMinPixels = 8, kMaxPixels = 16;
    const int all =
        std::clamp(int(kShare * samplesPerPixel * kBlockSize * kBlockSize / kPair), kMinPixels, kMaxPixels);
    return {std::min(int(samplesPerPixel), all / 2), all};
}

} // namespace

/// Shades all samples and measures the noise of blocks.
class PairPilot::Worker : public IntegratorWorker {
  public:
    Worker(const Scene& scene, float limit, PairPilot& pilot)
        : m_scene(scene), m_limit(limit), m_pilot(pilot) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        requestForEach(m_scene, batch, requests);
    }
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb>) override {
        return shaded;
    }
    void observe(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                 std::span<const FirstVertex> vertices) override {
        for (size_t p = 0; p < batch.pixels.size(); ++p) {
            const size_t block = m_pilot.m_blocks.blockOf(batch.pixels[p].x, batch.pixels[p].y);
            BlockNoise &first = m_pilot.m_halves[0][block], &second = m_pilot.m_halves[1][block];
            BlockNoise& noise = first.pairs > second.pairs ? second : first;
            for (size_t i = kPair * p; i < kPair * (p + 1); ++i) {
                if (!isHit(batch.samples, i))
                    continue;
                ++noise.cameraHits;
                const Rgb& emitted = vertices[i].emitted;
                noise.hitsLamps |= std::max({emitted.x, emitted.y, emitted.z}) > 1;
            }
            addPair(&radiance[kPair * p], &vertices[kPair * p], m_limit, noise);
        }
        for (const FirstVertex& vertex : vertices)
            m_brightness.add(vertex.direct, vertex.indirect);
    }
    void endTile(const PixelBounds&, Film&) override {
        const std::lock_guard lock(m_pilot.m_mutex);
        m_pilot.m_brightness.add(std::exchange(m_brightness, {}));
    }

  private:
    const Scene& m_scene;
    const float m_limit;
    PairPilot& m_pilot;
    Brightness m_brightness; ///< of the current tile
};

class PairPilot::State : public IntegratorState {
  public:
    /// `limit`: see addVariance.
    State(const Scene& scene, float limit, PairPilot& pilot)
        : m_scene(scene), m_limit(limit), m_pilot(pilot) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<Worker>(m_scene, m_limit, m_pilot);
    }
    bool observes() const override { return true; }

  private:
    const Scene& m_scene;
    const float m_limit;
    PairPilot& m_pilot;
};

/// The ranks of pixels in the order of bayerPosition.
struct PairPilot::Ranks {
    int first, end;
};

/// Renders tiles on one thread. The film's image is not used.
struct PairPilot::ThreadRenderer {
    std::unique_ptr<PilotRenderer> renderer;
    Film film;
};

// A sample in a pixel of n samples adds up to 1 to the clipped radiance of the pixel if it is n.
PairPilot::PairPilot(const Scene& scene, const RenderContext& context, double samplesPerPixel)
    : m_context(context), m_samplesPerPixel(samplesPerPixel), m_blocks(context.pilotBounds, kBlockSize),
      m_rays(m_blocks.factors().size()),
      m_state(std::make_unique<State>(scene, float(samplesPerPixel), *this)) {
    for (std::vector<BlockNoise>& half : m_halves)
        half.resize(m_rays.size());
}

PairPilot::~PairPilot() = default;

void PairPilot::renderFirst() {
    const int count = pixelsPerBlock(m_samplesPerPixel).first;
    render([&](size_t block) { return Ranks{0, isFirst(block) ? count : 0}; });
}

void PairPilot::renderRest() {
    const PixelCounts counts = pixelsPerBlock(m_samplesPerPixel);
    render([&](size_t block) { return Ranks{isFirst(block) ? counts.first : 0, counts.all}; });
}

/// Returns true in the fields of renderFirst.
bool PairPilot::isFirst(size_t block) const {
    constexpr int kFieldSize = 16;
    static_assert(kFieldSize % kBlockSize == 0, "a block belongs to one field");
    const PixelBounds pixels = boundsOf(block);
    return ((pixels.x0 - m_blocks.bounds().x0) / kFieldSize +
            (pixels.y0 - m_blocks.bounds().y0) / kFieldSize) %
               2 ==
           0;
}

/// Renders the pixels of each block that have the ranks ranksOf(block).
template <class RanksOf>
void PairPilot::render(const RanksOf& ranksOf) {
    const PixelBounds& bounds = m_blocks.bounds();
    std::vector<PixelBounds> tiles;
    for (int y = bounds.y0; y < bounds.y1; y += kTileHeight)
        for (int x = bounds.x0; x < bounds.x1; x += kTileWidth)
            tiles.push_back(
                {x, y, std::min(x + kTileWidth, bounds.x1), std::min(y + kTileHeight, bounds.y1)});
    parallelFor(tiles.size(), [&](size_t i) {
        ThreadRenderer& thread = m_threads.local([&] {
            return std::make_unique<ThreadRenderer>(
                ThreadRenderer{m_context.makePilotRenderer(*m_state, kPair), {bounds.x1, bounds.y1, {}}});
        });
        std::vector<V2i> pixels;
        forEachBlock(tiles[i], [&](size_t block) { addPixels(block, ranksOf(block), pixels); });
        thread.film.moveTo(tiles[i]);
        addCounters(tiles[i], thread.renderer->render(thread.film, pixels, kSeed));
    });
}

/// Adds the pixels of a block with these ranks, column by column.
void PairPilot::addPixels(size_t block, const Ranks& ranks, std::vector<V2i>& out) const {
    static_assert(kBlockSize * kBlockSize <= 64, "a word has a bit for each pixel");
    const uint64_t scramble = hashOf(kSeed, block);
    uint64_t chosen = 0;
    for (int rank = ranks.first; rank < ranks.end; ++rank) {
        const V2i position = bayerPosition(rank);
        const int x = (position.x ^ int(scramble)) & (kBlockSize - 1),
                  y = (position.y ^ int(scramble >> 8)) & (kBlockSize - 1);
        chosen |= uint64_t(1) << (kBlockSize * x + y);
    }
    const PixelBounds pixels = boundsOf(block);
    for (; chosen != 0; chosen &= chosen - 1) {
        const int bit = std::countr_zero(chosen);
        const int x = pixels.x0 + bit / kBlockSize, y = pixels.y0 + bit % kBlockSize;
        if (x < pixels.x1 && y < pixels.y1)
            out.push_back({x, y});
    }
}

/// Adds the counters of a tile. The first time, sets the rays of its blocks to their mean over the tile.
void PairPilot::addCounters(const PixelBounds& tile, const Counters& counters) {
    if (counters.visibilitySamples == 0)
        return;
    std::vector<size_t> ofTile;
    double vertices = 0;
    forEachBlock(tile, [&](size_t block) {
        ofTile.push_back(block);
        for (const auto& half : m_halves)
            vertices += double(half[block].vertices);
    });
    const double rays = 1 + double(counters.rays() - counters.visibilitySamples) / std::max(vertices, 1.);
    for (const size_t block : ofTile)
        if (m_rays[block] == 0)
            m_rays[block] = float(rays);
    const std::lock_guard lock(m_mutex);
    m_counters.add(counters);
}

/// Calls visit(block) for the blocks of a tile.
template <class Visit>
void PairPilot::forEachBlock(const PixelBounds& tile, const Visit& visit) const {
    for (int y = tile.y0; y < tile.y1; y += kBlockSize)
        for (int x = tile.x0; x < tile.x1; x += kBlockSize)
            visit(m_blocks.blockOf(x, y));
}

bool PairPilot::isEmpty() const {
    for (size_t i = 0; i < m_rays.size(); ++i)
        if (pairs(i) > 0)
            return false;
    return true;
}

bool PairPilot::seesLamps() const {
    for (size_t i = 0; i < m_rays.size(); ++i)
        if (m_halves[0][i].hitsLamps || m_halves[1][i].hitsLamps)
            return true;
    return false;
}

EmissionPilot PairPilot::emission() const {
    constexpr double kMinGain = 1.3; // emission is recorded for this only
    double pairCount = 0, variance = 0;
    for (const std::vector<BlockNoise>& half : m_halves)
        for (const BlockNoise& noise : half) {
            pairCount += double(noise.pairs);
            variance += double(noise.vertex.raw);
        }
    return {variance / (std::max(pairCount, 1.) * m_samplesPerPixel), 1, kMinGain};
}

PixelBounds PairPilot::boundsOf(size_t block) const {
    const PixelBounds& bounds = m_blocks.bounds();
    const int x = bounds.x0 + kBlockSize * int(block % size_t(m_blocks.columns())),
              y = bounds.y0 + kBlockSize * int(block / size_t(m_blocks.columns()));
    return {x, y, std::min(x + kBlockSize, bounds.x1), std::min(y + kBlockSize, bounds.y1)};
}

} // namespace strobe
