#include "sharing/sample_plan.h"

#include "core/math/hash.h"
#include "core/util/parallel.h"

#include <algorithm>
#include <cmath>

namespace strobe {

namespace {

constexpr uint64_t kSeed = 0x73616d706c6573;
constexpr int kBlockSize = 8, kTileSize = 64, kPixelsPerBlock = kBlockSize * kBlockSize;
static_assert(kTileSize % kBlockSize == 0, "a block belongs to one tile");
/// The samples of a pixel of the pilot: their difference shows the variance.
constexpr int kPair = 2;
constexpr uint32_t kMaxFactor = 16;
/// The largest time of the render relative to that with factors of 1.
constexpr double kMaxTime = 2;
/// The samples of the pilot relative to those of the render.
constexpr double kPilotShare = 0.02;
/// Sharing leaves about this part of the variance of light that is shared.
constexpr double kSharedNoise = 0.3;
/// The cost of a sample without a first vertex relative to that of others.
constexpr double kMissCost = 0.15;

/// The samples of the pilot in a block.
struct BlockNoise {
    double pairs = 0;
    double vertices = 0; ///< samples with a first vertex
    double radiance = 0; ///< sum over the samples, clipped; mean of the channels
    /// The variances of a sample, summed over the pairs, of light that is not shared, and of all light.
    double rest = 0, all = 0;
};

Rgb clipped(const Rgb& c) { return {std::min(c.x, 1.f), std::min(c.y, 1.f), std::min(c.z, 1.f)}; }

double varianceOf(const Rgb& a, const Rgb& b) {
    const Rgb d = clipped(a) - clipped(b);
    return double(d.x * d.x + d.y * d.y + d.z * d.z) / 6;
}

/// Shades all samples and measures the noise of blocks.
class PairWorker : public IntegratorWorker {
  public:
    PairWorker(const Scene& scene, LightParts shared, const SampleFactors& blocks,
               std::vector<BlockNoise>& noise)
        : m_scene(scene), m_shared(shared), m_blocks(blocks), m_noise(noise) {}
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
            BlockNoise& noise = m_noise[m_blocks.blockOf(batch.pixels[p].x, batch.pixels[p].y)];
            Rgb all[kPair], rest[kPair];
            for (size_t k = 0; k < kPair; ++k) {
                const size_t i = kPair * p + k;
                all[k] = radiance[i];
                rest[k] = radiance[i];
                if (m_shared.has(LightPart::Direct))
                    rest[k] -= vertices[i].direct;
                if (m_shared.has(LightPart::Indirect))
                    rest[k] -= vertices[i].indirect;
                const Rgb c = clipped(all[k]);
                noise.radiance += double(c.x + c.y + c.z) / 3;
                noise.vertices += bool(vertices[i].hit);
            }
            noise.all += varianceOf(all[0], all[1]);
            noise.rest += varianceOf(rest[0], rest[1]);
            ++noise.pairs;
        }
    }

  private:
    const Scene& m_scene;
    const LightParts m_shared;
    const SampleFactors& m_blocks;
    std::vector<BlockNoise>& m_noise;
};

class PairState : public IntegratorState {
  public:
    PairState(const Scene& scene, LightParts shared, const SampleFactors& pixels, const SampleFactors& blocks,
              std::vector<BlockNoise>& noise)
        : m_scene(scene), m_shared(shared), m_pixels(pixels), m_blocks(blocks), m_noise(noise) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<PairWorker>(m_scene, m_shared, m_blocks, m_noise);
    }
    const SampleFactors* sampleFactors() const override { return &m_pixels; }
    bool observes() const override { return true; }

  private:
    const Scene& m_scene;
    const LightParts m_shared;
    const SampleFactors &m_pixels, &m_blocks;
    std::vector<BlockNoise>& m_noise;
};

/// Returns the position of a pixel in the order of a Bayer matrix, whose first pixels are spread evenly over
/// the block.
int bayerRank(int x, int y) {
    int rank = 0;
    for (int bit = 1; bit < kBlockSize; bit *= 2)
        rank = 4 * rank + 2 * bool((x ^ y) & bit) + bool(y & bit);
    return rank;
}

/// Returns the pixels of the pilot: factors 1 and 0.
SampleFactors choosePixels(const SampleFactors& blocks, int perBlock) {
    SampleFactors out(blocks.bounds(), 1);
    const PixelBounds& bounds = blocks.bounds();
    for (int y = bounds.y0; y < bounds.y1; ++y)
        for (int x = bounds.x0; x < bounds.x1; ++x) {
            const uint64_t scramble = hashOf(kSeed, blocks.blockOf(x, y));
            const int u = ((x - bounds.x0) ^ int(scramble)) & (kBlockSize - 1),
                      v = ((y - bounds.y0) ^ int(scramble >> 8)) & (kBlockSize - 1);
            out.factors()[out.blockOf(x, y)] = bayerRank(u, v) < perBlock;
        }
    return out;
}

std::vector<BlockNoise> measureNoise(const Scene& scene, const RenderContext& context, LightParts shared,
                                     const SampleFactors& blocks, int pixelsPerBlock) {
    const SampleFactors pixels = choosePixels(blocks, pixelsPerBlock);
    std::vector<BlockNoise> noise(blocks.factors().size());
    const PixelBounds& bounds = blocks.bounds();
    const int columns = (bounds.width() + kTileSize - 1) / kTileSize,
              rows = (bounds.height() + kTileSize - 1) / kTileSize;
    parallelFor(size_t(columns) * size_t(rows), [&](size_t i) {
        const int x = bounds.x0 + kTileSize * int(i % size_t(columns)),
                  y = bounds.y0 + kTileSize * int(i / size_t(columns));
        Film film(bounds.x1, bounds.y1,
                  {x, y, std::min(x + kTileSize, bounds.x1), std::min(y + kTileSize, bounds.y1)});
        PairState pilot(scene, shared, pixels, blocks, noise);
        context.renderPilot(pilot, film, kPair, kSeed);
    });
    return noise;
}

/// The squared error and the time of a block per sample of its pixels.
struct BlockCost {
    double error, time;
    /// Neyman allocation: the number of samples is in proportion to this.
    double density() const { return std::sqrt(error / time); }
};

/// Returns the errors and the times of blocks, averaged with those of their neighbors.
std::vector<BlockCost> blockCosts(const SampleFactors& blocks, const std::vector<BlockNoise>& noise) {
    constexpr double kDark = 0.1;
    std::vector<BlockCost> raw, out;
    for (const BlockNoise& block : noise) {
        const double pairs = std::max(block.pairs, 1.), samples = kPair * pairs;
        const double variance = (block.rest + kSharedNoise * block.all) / pairs;
        raw.push_back({variance / (block.radiance / samples + kDark),
                       kMissCost + (1 - kMissCost) * block.vertices / samples});
    }
    for (int y = 0; y < blocks.rows(); ++y)
        for (int x = 0; x < blocks.columns(); ++x) {
            BlockCost sum{0, 0};
            double weights = 0;
            for (int v = std::max(y - 1, 0); v <= std::min(y + 1, blocks.rows() - 1); ++v)
                for (int u = std::max(x - 1, 0); u <= std::min(x + 1, blocks.columns() - 1); ++u) {
                    const double weight = (u == x ? 2 : 1) * (v == y ? 2 : 1);
                    const BlockCost& cost = raw[size_t(v) * size_t(blocks.columns()) + size_t(u)];
                    sum.error += weight * cost.error;
                    sum.time += weight * cost.time;
                    weights += weight;
                }
            out.push_back({sum.error / weights, sum.time / weights});
        }
    return out;
}

/// Returns the power of two next to a factor.
uint32_t roundedFactor(double factor) {
    const double limited = std::clamp(factor, 1., double(kMaxFactor));
    return 1u << int(std::lround(std::log2(limited)));
}

/// Returns the product of error and time with factors of `scale` times the density; infinity if the time is
/// more than kMaxTime times that of factors of 1.
double productFor(const std::vector<BlockCost>& costs, double scale) {
    double error = 0, time = 0, leastTime = 0;
    for (const BlockCost& block : costs) {
        const double factor = roundedFactor(scale * block.density());
        error += block.error / factor;
        time += block.time * factor;
        leastTime += block.time;
    }
    return time <= kMaxTime * leastTime ? error * time : INFINITY;
}

/// Returns the scale of the densities that leaves about the least product of error and time; 0 if that gains
/// little.
double findScale(const std::vector<BlockCost>& costs) {
    constexpr double kMinGain = 1.05, kNearlyLeast = 1.03, kStep = 1.25;
    constexpr double kMaxScale = 64; // in units of the inverse of the largest density
    double largest = 0;
    for (const BlockCost& block : costs)
        largest = std::max(largest, block.density());
    if (largest == 0)
        return 0;
    std::vector<std::pair<double, double>> products; // and their scales
    for (double scale = 1 / largest; scale * largest < kMaxScale; scale *= kStep)
        products.emplace_back(productFor(costs, scale), scale);
    const double least = std::min_element(products.begin(), products.end())->first;
    if (least * kMinGain > productFor(costs, 0))
        return 0;
    return std::find_if(products.begin(), products.end(),
                        [&](const auto& p) { return p.first <= kNearlyLeast * least; })
        ->second;
}

} // namespace

std::optional<SampleFactors> planSamples(const Scene& scene, const RenderContext& context,
                                         LightParts shared) {
    constexpr double kPassSamples = 16;            // of passes, whose number is not known
    constexpr int kMinSamples = 4, kMinPixels = 4; // fewer samples are not worth a pilot
    const double samples = context.isPass ? kPassSamples : context.samplesPerPixel;
    if (samples < kMinSamples || samples * kMaxFactor > PixelAccumulator::kMaxSamples)
        return {};
    SampleFactors blocks(context.pilotBounds, kBlockSize);
    const int pixels =
        std::clamp(int(kPilotShare * samples * kPixelsPerBlock / kPair), kMinPixels, kPixelsPerBlock);
    const std::vector<BlockNoise> noise = measureNoise(scene, context, shared, blocks, pixels);
    const std::vector<BlockCost> costs = blockCosts(blocks, noise);
    const double scale = findScale(costs);
    if (scale == 0)
        return {};
    for (size_t i = 0; i < costs.size(); ++i)
        blocks.factors()[i] = roundedFactor(scale * costs[i].density());
    return blocks;
}

} // namespace strobe
