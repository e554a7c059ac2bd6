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
constexpr int kMaxExponent = 4; ///< of the factors, which are powers of two
/// The largest time of the render relative to that with factors of 1.
constexpr double kMaxTime = 2;
/// The samples of the pilot relative to those of the render.
constexpr double kPilotShare = 0.02;
/// Sharing leaves about this part of the variance of indirect light. It hardly depends on the number of
/// samples, while that of direct light falls with it, shared or not (measured).
constexpr float kSharedNoise = 0.03f;
/// The time of a sample whose path has no first vertex, in units of a ray.
constexpr float kMissTime = 0.3f;

/// The samples of one half of the pilot in a block.
struct BlockNoise {
    float pairs = 0;
    float vertices = 0; ///< samples with a first vertex
    float radiance = 0; ///< sum over the samples, clipped to 1; mean of the channels
    // Variances of a sample, summed over the pairs:
    float rest = 0;    ///< of all but shared indirect light, clipped to the number of samples of a pixel
    float rawRest = 0; ///< the same, not clipped
    float shared = 0;  ///< the part of the variance of shared light, clipped to 1, that sharing leaves
};

/// The noise and the rays of all blocks, measured by the pilot.
struct PilotNoise {
    explicit PilotNoise(size_t blocks) : rays(blocks) {
        for (auto& half : halves)
            half.resize(blocks);
    }
    std::vector<BlockNoise> halves[kHalves]; ///< by block; each half has every other pair
    std::vector<float> rays;                 ///< by block: mean rays of a sample with a first vertex
};

Rgb clipped(const Rgb& c, float limit) {
    return {std::min(c.x, limit), std::min(c.y, limit), std::min(c.z, limit)};
}

/// Returns the variance of a sample that two samples show, mean of the channels.
float varianceOf(const Rgb& a, const Rgb& b) {
    const Rgb d = a - b;
    return (d.x * d.x + d.y * d.y + d.z * d.z) / 6;
}

/// Shades all samples and measures the noise of blocks.
class PairWorker : public IntegratorWorker {
  public:
    /// `limit`: to which all but shared indirect light is clipped.
    PairWorker(const Scene& scene, LightParts shared, float limit, const SampleFactors& blocks,
               PilotNoise& noise)
        : m_scene(scene), m_shared(shared), m_limit(limit), m_blocks(blocks), m_noise(noise) {}
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
            const size_t block = m_blocks.blockOf(batch.pixels[p].x, batch.pixels[p].y);
            const bool isSecond = m_noise.halves[0][block].pairs > m_noise.halves[1][block].pairs;
            addPair(&radiance[kPair * p], &vertices[kPair * p], m_noise.halves[isSecond][block]);
        }
    }

  private:
    void addPair(const Rgb* radiance, const FirstVertex* vertices, BlockNoise& noise) const {
        const Rgb sum = radiance[0] + radiance[1];
        if (!std::isfinite(sum.x + sum.y + sum.z))
            return; // invalid samples: the film leaves them out, too
        Rgb rest[kPair];
        for (int k = 0; k < kPair; ++k) {
            rest[k] = radiance[k];
            if (m_shared.has(LightPart::Indirect))
                rest[k] -= vertices[k].indirect;
            if (!m_shared.isEmpty())
                rest[k] -= vertices[k].emitted; // its noise is EmissionRefinement's task
            const Rgb c = clipped(radiance[k], 1);
            noise.radiance += (c.x + c.y + c.z) / 3;
            noise.vertices += bool(vertices[k].hit);
        }
        if (!m_shared.isEmpty())
            noise.shared += kSharedNoise *
                            varianceOf(clipped(radiance[0] - rest[0], 1), clipped(radiance[1] - rest[1], 1));
        noise.rest += varianceOf(clipped(rest[0], m_limit), clipped(rest[1], m_limit));
        noise.rawRest += varianceOf(rest[0], rest[1]);
        ++noise.pairs;
    }

    const Scene& m_scene;
    const LightParts m_shared;
    const float m_limit;
    const SampleFactors& m_blocks;
    PilotNoise& m_noise;
};

class PairState : public IntegratorState {
  public:
    /// `pixels`: factors of 1 and 0.
    PairState(const Scene& scene, LightParts shared, float limit, const SampleFactors& pixels,
              const SampleFactors& blocks, PilotNoise& noise)
        : m_scene(scene), m_shared(shared), m_limit(limit), m_pixels(pixels), m_blocks(blocks),
          m_noise(noise) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<PairWorker>(m_scene, m_shared, m_limit, m_blocks, m_noise);
    }
    const SampleFactors* sampleFactors() const override { return &m_pixels; }
    bool observes() const override { return true; }

  private:
    const Scene& m_scene;
    const LightParts m_shared;
    const float m_limit;
    const SampleFactors &m_pixels, &m_blocks;
    PilotNoise& m_noise;
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
    for (size_t block = 0; block < blocks.factors().size(); ++block) {
        const uint64_t scramble = hashOf(kSeed, block);
        const int x0 = bounds.x0 + kBlockSize * int(block % size_t(blocks.columns())),
                  y0 = bounds.y0 + kBlockSize * int(block / size_t(blocks.columns()));
        for (int y = y0; y < std::min(y0 + kBlockSize, bounds.y1); ++y)
            for (int x = x0; x < std::min(x0 + kBlockSize, bounds.x1); ++x) {
                const int u = ((x - x0) ^ int(scramble)) & (kBlockSize - 1),
                          v = ((y - y0) ^ int(scramble >> 8)) & (kBlockSize - 1);
                out.factors()[out.blockOf(x, y)] = bayerRank(u, v) < perBlock;
            }
    }
    return out;
}

/// Sets PilotNoise::rays of the blocks of a tile to their mean over the tile.
void setRays(const Counters& counters, const PixelBounds& tile, const SampleFactors& blocks,
             PilotNoise& noise) {
    std::vector<size_t> ofTile;
    double vertices = 0;
    for (int y = tile.y0; y < tile.y1; y += kBlockSize)
        for (int x = tile.x0; x < tile.x1; x += kBlockSize) {
            ofTile.push_back(blocks.blockOf(x, y));
            for (const auto& half : noise.halves)
                vertices += double(half[ofTile.back()].vertices);
        }
    const double rays = 1 + double(counters.rays() - counters.visibilitySamples) / std::max(vertices, 1.);
    for (const size_t block : ofTile)
        noise.rays[block] = float(rays);
}

/// Renders tiles of the pilot on one thread. The film's image is not used.
struct PairRenderer {
    std::unique_ptr<PilotRenderer> renderer;
    Film film;
};

/// The pilot: pairs of samples in some pixels of each block.
class PairPilot {
  public:
    /// `limit`: see PairWorker.
    PairPilot(const Scene& scene, const RenderContext& context, LightParts shared, float limit,
              const SampleFactors& blocks, int pixelsPerBlock)
        : m_context(context), m_blocks(blocks), m_pixels(choosePixels(blocks, pixelsPerBlock)),
          m_noise(blocks.factors().size()), m_state(scene, shared, limit, m_pixels, blocks, m_noise) {}
    /// Renders every other tile, like the fields of one color of a chessboard. `color`: 0 or 1.
    void render(int color) {
        const PixelBounds& bounds = m_blocks.bounds();
        std::vector<PixelBounds> tiles;
        for (int y = bounds.y0, row = color; y < bounds.y1; y += kTileSize, ++row)
            for (int x = bounds.x0 + kTileSize * (row % 2); x < bounds.x1; x += 2 * kTileSize)
                tiles.push_back(
                    {x, y, std::min(x + kTileSize, bounds.x1), std::min(y + kTileSize, bounds.y1)});
        parallelFor(tiles.size(), [&](size_t i) {
            PairRenderer& thread = m_threads.local([&] {
                return std::make_unique<PairRenderer>(
                    PairRenderer{m_context.makePilotRenderer(m_state, kPair), {bounds.x1, bounds.y1, {}}});
            });
            thread.film.moveTo(tiles[i]);
            setRays(thread.renderer->render(thread.film, kSeed), tiles[i], m_blocks, m_noise);
        });
    }
    /// Blocks in tiles that are not rendered have no pairs.
    const PilotNoise& noise() const { return m_noise; }

  private:
    const RenderContext& m_context;
    const SampleFactors &m_blocks, m_pixels;
    PilotNoise m_noise;
    PairState m_state;
    PerThread<PairRenderer> m_threads;
};

/// The squared errors and the time of pixels per sample.
template <class Real>
struct Costs {
    Real error = 0;    ///< of all but shared indirect light; clipped
    Real rawError = 0; ///< not clipped
    Real shared = 0;   ///< of shared indirect light
    Real time = 0;     ///< 0: not measured
    template <class Other>
    void add(const Costs<Other>& other, Real weight) {
        error += weight * Real(other.error);
        rawError += weight * Real(other.rawError);
        shared += weight * Real(other.shared);
        time += weight * Real(other.time);
    }
};

struct BlockCost : Costs<float> {
    /// The binary logarithm of the density of samples, the root of the error over the time (Neyman
    /// allocation); -infinity without an error.
    float logDensity = -INFINITY;
};

/// Returns the cost of a block that has the samples of both `a` and `b`. `rays`: see PilotNoise.
BlockCost costOf(const BlockNoise& a, const BlockNoise& b, float rays) {
    constexpr float kDark = 0.1f;
    const float pairs = a.pairs + b.pairs, samples = kPair * pairs;
    if (pairs == 0)
        return {};
    const float vertices = (a.vertices + b.vertices) / samples;
    const float weight = 1 / (pairs * ((a.radiance + b.radiance) / samples + kDark));
    BlockCost cost;
    cost.error = weight * (a.rest + b.rest);
    cost.rawError = weight * (a.rawRest + b.rawRest);
    cost.shared = weight * (a.shared + b.shared);
    cost.time = kMissTime * (1 - vertices) + rays * vertices;
    return cost;
}

/// Returns the mean of the costs of a block and of its neighbors that were measured.
BlockCost smoothed(const std::vector<BlockCost>& costs, int columns, int rows, int x, int y) {
    BlockCost sum, mean;
    float weights = 0;
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, rows - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, columns - 1); ++u) {
            const BlockCost& cost = costs[size_t(v) * size_t(columns) + size_t(u)];
            if (cost.time == 0)
                continue;
            const float weight = float((u == x ? 2 : 1) * (v == y ? 2 : 1));
            sum.add(cost, weight);
            weights += weight;
        }
    if (weights > 0)
        mean.add(sum, 1 / weights);
    if (mean.error > 0)
        mean.logDensity = std::log2(mean.error / mean.time) / 2;
    return mean;
}

/// Returns the means of the costs of blocks and of their neighbors, with their densities.
std::vector<BlockCost> smoothed(const std::vector<BlockCost>& costs, int columns, int rows) {
    std::vector<BlockCost> out;
    out.reserve(costs.size());
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            out.push_back(smoothed(costs, columns, rows, x, y));
    return out;
}

/// The costs of all blocks: by each half of the pilot, and by the whole.
struct PilotCosts {
    std::vector<BlockCost> halves[kHalves], whole;
    PilotCosts(const SampleFactors& blocks, const PilotNoise& noise) {
        for (std::vector<BlockCost>* costs : {&halves[0], &halves[1], &whole})
            costs->reserve(noise.rays.size());
        for (size_t i = 0; i < noise.rays.size(); ++i) {
            const BlockNoise &a = noise.halves[0][i], &b = noise.halves[1][i];
            halves[0].push_back(costOf(a, {}, noise.rays[i]));
            halves[1].push_back(costOf(b, {}, noise.rays[i]));
            whole.push_back(costOf(a, b, noise.rays[i]));
        }
        for (std::vector<BlockCost>* costs : {&halves[0], &halves[1], &whole})
            *costs = smoothed(*costs, blocks.columns(), blocks.rows());
    }
};

/// Returns the power of two next to a factor, given its binary logarithm.
uint8_t roundedFactor(double exponent) {
    return uint8_t(1u << int(std::clamp(exponent, 0., double(kMaxExponent)) + 0.5));
}

/// The costs of all blocks in bins of their density. At a step, a block of the largest density has a factor
/// of 2^(step / kSteps). One half of the pilot gives the densities, and the other half the errors. Otherwise,
/// noise of the pilot would look like a gain.
class DensityBins {
  public:
    static constexpr int kSteps = 4, kStepCount = 10 * kSteps;

    /// `largest`: the binary logarithm of the largest density.
    DensityBins(const PilotCosts& costs, double largest) {
        for (int half = 0; half < kHalves; ++half)
            for (size_t i = 0; i < costs.whole.size(); ++i) {
                const double density = double(costs.halves[half][i].logDensity) - largest;
                BlockCost cost = costs.halves[1 - half][i];
                cost.time = costs.whole[i].time;
                m_bins[binOf(density)].add(cost, 1);
            }
    }
    /// Returns the product of error and time with the factors of a step; a negative step: with factors of 1.
    /// Returns infinity if the time is more than kMaxTime times that of factors of 1, or if the product grows
    /// for radiance that is not clipped: if rare bright samples are elsewhere.
    double productFor(int step) const {
        double error = 0, rawError = 0, time = 0, leastTime = 0, mostRawError = 0;
        for (int i = 0; i < kBins; ++i) {
            const Costs<double>& bin = m_bins[i];
            const double factor = step < 0 ? 1 : 1 << exponentOf(i, step);
            error += bin.error / factor + bin.shared;
            rawError += bin.rawError / factor + bin.shared;
            time += bin.time * factor;
            leastTime += bin.time;
            mostRawError += bin.rawError + bin.shared;
        }
        const bool isAllowed = time <= kMaxTime * leastTime && rawError * time <= mostRawError * leastTime;
        return isAllowed ? error * time : INFINITY;
    }

  private:
    /// Blocks of the first bin have a factor of 1 at all steps, those of the last bin the largest factor.
    static constexpr int kFirst = -kStepCount, kLast = kSteps * kMaxExponent, kBins = kLast - kFirst + 1;

    static size_t binOf(double logDensity) {
        const double bin = std::floor(kSteps * (logDensity + 0.5));
        return size_t(std::clamp(bin, double(kFirst), double(kLast)) - kFirst);
    }
    /// Returns the exponent of roundedFactor for a bin.
    static int exponentOf(int bin, int step) {
        return std::clamp((bin + kFirst + step + kStepCount) / kSteps - kStepCount / kSteps, 0, kMaxExponent);
    }
    Costs<double> m_bins[kBins];
};

/// Returns the binary logarithm of the scale of the densities that leaves about the least product of error
/// and time; none, if that gains less than a factor of minGain.
std::optional<double> findLogScale(const PilotCosts& costs, double minGain) {
    constexpr double kNearlyLeast = 1.03;
    float largest = -INFINITY;
    for (const BlockCost& block : costs.whole)
        largest = std::max(largest, block.logDensity);
    if (largest == -INFINITY)
        return {};
    const DensityBins bins(costs, double(largest));
    std::vector<double> products; // by step
    for (int step = 0; step < DensityBins::kStepCount; ++step)
        products.push_back(bins.productFor(step));
    const double least = *std::min_element(products.begin(), products.end());
    if (least * minGain > bins.productFor(-1))
        return {};
    const auto chosen = std::find_if(products.begin(), products.end(),
                                     [&](double product) { return product <= kNearlyLeast * least; });
    return double(chosen - products.begin()) / DensityBins::kSteps - double(largest);
}

} // namespace

std::optional<SampleFactors> planSamples(const Scene& scene, const RenderContext& context,
                                         LightParts shared) {
    constexpr double kPassSamples = 16; // of passes, whose number is not known
    constexpr int kMinSamples = 4;      // fewer are not worth a pilot
    constexpr int kMinPixels = 2, kMaxPixels = 16;
    // Small gains are those of squared errors only: structural errors grow, as they count all blocks alike,
    // most where no light is shared (measured).
    constexpr double kMinGain = 1.3, kMinGainAlone = 1.8;
    // Where nothing is shared, the pilot is the whole overhead. It ends if half of the tiles promise less
    // than this. In scenes whose samples adapt, either half promises 1.8 and more (4 samples).
    constexpr double kMinGainOfHalf = 1.4;
    const double samples = context.isPass ? kPassSamples : context.samplesPerPixel;
    if (samples < kMinSamples || samples * (1 << kMaxExponent) > PixelAccumulator::kMaxSamples)
        return {};
    SampleFactors blocks(context.pilotBounds, kBlockSize);
    const int pixels =
        std::clamp(int(kPilotShare * samples * kPixelsPerBlock / kPair), kMinPixels, kMaxPixels);
    // A sample in a pixel of n samples adds up to 1 to the clipped radiance of the pixel if it is n.
    PairPilot pilot(scene, context, shared, float(samples), blocks, pixels);
    pilot.render(0);
    if (shared.isEmpty() && !findLogScale(PilotCosts(blocks, pilot.noise()), kMinGainOfHalf))
        return {};
    pilot.render(1);
    const PilotCosts costs(blocks, pilot.noise());
    const auto logScale = findLogScale(costs, shared.isEmpty() ? kMinGainAlone : kMinGain);
    if (!logScale)
        return {};
    for (size_t i = 0; i < costs.whole.size(); ++i)
        blocks.factors()[i] = roundedFactor(*logScale + double(costs.whole[i].logDensity));
    return blocks;
}

} // namespace strobe
