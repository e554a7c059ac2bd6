#include "sharing/noise_pilot.h"

#include "core/util/parallel.h"
#include "sharing/light_recorder.h"
#include "sharing/reconstruction.h"

#include <algorithm>

namespace strobe {

namespace {

/// The seeds of the two renders of a block. They do not depend on the seed of the render, so that renders of
/// a scene with different seeds share the same parts.
constexpr uint64_t kSeeds[] = {0x70696c6f74, 0x74706c696f};

constexpr LightPart kAllParts[kParts] = {LightPart::Direct, LightPart::Indirect};

/// The sets of parts to choose from; the first is empty.
const LightParts kChoices[] = {LightParts(0), LightParts(1), LightParts(2), LightParts(3)};
constexpr size_t kChoiceCount = std::size(kChoices);

/// The errors are measured twice, with radiance clipped to each of these values. Unclipped errors contain
/// those of rare bright samples. Errors of radiance clipped to 1 are less noisy.
constexpr float kClips[] = {INFINITY, 1};

/// Sums over the pixels of blocks.
struct BlockSums {
    double pixels = 0;
    double variance = 0;            ///< estimated by LightSharing for both parts, not relative
    double emissionCoefficient = 0; ///< see EmissionPilot
    double recorded = 0;            ///< samples with a first vertex
    Counters counters;
    void add(const BlockSums& other) {
        pixels += other.pixels;
        variance += other.variance;
        emissionCoefficient += other.emissionCoefficient;
        recorded += other.recorded;
        counters.add(other.counters);
    }
};

/// The largest channel of the light of each sample, by part.
struct Brightness {
    std::vector<float> values[kParts];
    void add(const Brightness& other) {
        for (int part = 0; part < kParts; ++part)
            values[part].insert(values[part].end(), other.values[part].begin(), other.values[part].end());
    }
    /// Returns limits far above those that this fraction of the samples of each part exceeds.
    RareLimits limits(double fraction) {
        constexpr float kMargin = 3;
        RareLimits out;
        for (int part = 0; part < kParts; ++part) {
            std::vector<float>& all = values[part];
            const auto count = std::max(std::ptrdiff_t(fraction * double(all.size())), std::ptrdiff_t(1));
            if (count >= std::ptrdiff_t(all.size()))
                continue;
            std::nth_element(all.begin(), all.begin() + count, all.end(), std::greater<float>());
            if (all[size_t(count)] > 0)
                out.of[part] = kMargin * all[size_t(count)];
        }
        return out;
    }
};

/// Records the samples of a block, and their brightness.
class PilotWorker : public RecordingWorker {
  public:
    PilotWorker(const Scene& scene, float cellSize, float clamp, FrameLight& frame, Brightness& brightness)
        : RecordingWorker(scene, cellSize, clamp, LightParts::all(), frame), m_brightness(brightness) {}
    void observe(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                 std::span<const FirstVertex> vertices) override {
        RecordingWorker::observe(batch, radiance, vertices);
        for (const FirstVertex& vertex : vertices) {
            m_brightness.values[int(LightPart::Direct)].push_back(maxComponent(vertex.direct));
            m_brightness.values[int(LightPart::Indirect)].push_back(maxComponent(vertex.indirect));
        }
    }

  private:
    Brightness& m_brightness;
};

/// Records one block at a time.
class PilotState : public IntegratorState {
  public:
    PilotState(const Scene& scene, float cellSize, float clamp)
        : m_scene(scene), m_cellSize(cellSize), m_clamp(clamp) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<PilotWorker>(m_scene, m_cellSize, m_clamp, m_frame, m_brightness);
    }
    bool observes() const override { return true; }
    /// Returns the light of the film, after its render.
    RecordedLight takeLight(const Film& film) { return m_frame.take(film); }
    /// That of all samples so far.
    const Brightness& brightness() const { return m_brightness; }

  private:
    const Scene& m_scene;
    const float m_cellSize, m_clamp;
    FrameLight m_frame{LightParts::all()};
    Brightness m_brightness;
};

/// Renders blocks on one thread.
class ThreadPilot {
  public:
    ThreadPilot(const Scene& scene, const RenderContext& context, int samplesPerPixel, float cellSize)
        : m_state(scene, cellSize, context.clamp),
          m_renderer(context.makePilotRenderer(m_state, samplesPerPixel)),
          m_film(context.pilotBounds.x1, context.pilotBounds.y1, {}) {}
    struct Block {
        Counters counters;
        std::vector<Rgb> image;
        RecordedLight light;
    };
    Block render(const PixelBounds& block, uint64_t seed) {
        m_film.moveTo(block);
        Counters counters = m_renderer->render(m_film, seed);
        std::vector<Rgb> image = m_film.image().pixels;
        return {std::move(counters), std::move(image), m_state.takeLight(m_film)};
    }
    const Brightness& brightness() const { return m_state.brightness(); }

  private:
    PilotState m_state;
    const std::unique_ptr<PilotRenderer> m_renderer;
    Film m_film;
};

/// Returns the image without the emission that camera rays hit. Its noise is EmissionRefinement's task.
std::vector<Rgb> reflectedLight(std::vector<Rgb> image, const RecordedLight& light) {
    std::vector<Rgb> out = std::move(image);
    for (size_t i = 0; i < out.size(); ++i) {
        const HalfPixelSums &a = light.pixel(i, 0), &b = light.pixel(i, 1);
        if (a.count + b.count > 0)
            out[i] -= (a.emitted + b.emitted) * (1 / float(a.count + b.count));
    }
    return out;
}

/// One render of a block.
struct BlockImages {
    std::vector<Rgb> images[kChoiceCount]; ///< by kChoices
    /// The errors that LightSharing estimates for both parts, without sharing and with it.
    double ownVariance = 0, variance = 0;
};

/// Reconstructs a block and adds it to `sums`.
BlockImages reconstruct(ThreadPilot::Block block, BlockSums& sums) {
    RecordedLight& light = block.light;
    sums.counters.add(block.counters);
    const auto pixels = double(block.image.size());
    sums.pixels += pixels;
    sums.emissionCoefficient += pixels * emissionPilot(light).coefficient;
    for (const CellSums& cell : light.cells)
        sums.recorded += double(cell.count[0]) + double(cell.count[1]);
    const std::vector<Rgb> own = reflectedLight(std::move(block.image), light);
    const LightSharing sharing(std::move(light));
    std::vector<SharedPart> parts;
    BlockImages out;
    for (const LightPart part : kAllParts) {
        parts.push_back(sharing.share(part));
        for (const PixelSharing& pixel : parts.back().pixels) {
            out.ownVariance += double(pixel.ownVariance);
            out.variance += double(pixel.variance);
        }
    }
    sums.variance += out.variance;
    for (size_t choice = 0; choice < kChoiceCount; ++choice) {
        out.images[choice] = own;
        for (size_t i = 0; i < out.images[choice].size(); ++i) {
            Rgb& pixel = out.images[choice][i];
            for (const LightPart part : kAllParts)
                if (kChoices[choice].has(part))
                    pixel += parts[size_t(part)].correction[i];
        }
    }
    return out;
}

double squaredDistance(const std::vector<Rgb>& a, const std::vector<Rgb>& b, float clip) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i)
        for (int c = 0; c < 3; ++c)
            sum += sqr(double(std::min(a[i][c], clip)) - double(std::min(b[i][c], clip)));
    return sum;
}

/// Returns the weight of the squared errors of an image with this mean: errors are relative to its radiance.
double weightOf(double mean) {
    constexpr double kDark = 0.1; // radiance below which errors do not count as relative ones
    return 1 / (sqr(mean) + sqr(kDark));
}

/// Returns the mean of the channels of an image.
double meanOf(const std::vector<Rgb>& image, float clip) {
    double sum = 0;
    for (const Rgb& pixel : image)
        for (int c = 0; c < 3; ++c)
            sum += double(std::min(pixel[c], clip));
    return sum / (3 * double(image.size()));
}

/// Adds the errors of the images of a block to `sums`, by kChoices. `a` and `b` are independent renders.
/// Their squared distance is twice the variance of one. The squared distance of a shared image from the other
/// render is its error plus this variance.
void addErrors(const BlockImages& a, const BlockImages& b, float clip, double* sums) {
    const double weight = weightOf((meanOf(a.images[0], clip) + meanOf(b.images[0], clip)) / 2);
    const double variance = squaredDistance(a.images[0], b.images[0], clip) / 2;
    sums[0] += weight * variance;
    for (size_t i = 1; i < kChoiceCount; ++i) {
        const double distances =
            squaredDistance(a.images[i], b.images[0], clip) + squaredDistance(b.images[i], a.images[0], clip);
        sums[i] += weight * (distances / 2 - variance);
    }
}

/// The measurements of one block.
struct BlockPilot {
    /// The squared errors of the images that share the parts of kChoices, relative to the radiance, by
    /// kClips.
    double errors[std::size(kClips)][kChoiceCount] = {};
    BlockSums sums;
    BlockImages first; ///< the first of two renders
};

/// Renders blocks of a scene. All functions but `brightness` are thread-safe.
class BlockRenderer {
  public:
    BlockRenderer(const Scene& scene, const RenderContext& context, int samplesPerPixel, float cellSize)
        : m_scene(scene), m_context(context), m_samplesPerPixel(samplesPerPixel), m_cellSize(cellSize) {}
    void renderFirst(const PixelBounds& block, BlockPilot& out) {
        out.first = render(block, kSeeds[0], out);
    }
    /// Renders a block again and measures the errors of sharing.
    void measure(const PixelBounds& block, BlockPilot& out) {
        const BlockImages second = render(block, kSeeds[1], out);
        for (size_t clip = 0; clip < std::size(kClips); ++clip)
            addErrors(out.first, second, kClips[clip], out.errors[clip]);
    }

    /// Returns the brightness of all samples so far.
    Brightness brightness() {
        Brightness out;
        m_threads.forEach([&](const ThreadPilot& pilot) { out.add(pilot.brightness()); });
        return out;
    }

  private:
    BlockImages render(const PixelBounds& block, uint64_t seed, BlockPilot& out) {
        ThreadPilot& pilot = m_threads.local([&] {
            return std::make_unique<ThreadPilot>(m_scene, m_context, m_samplesPerPixel, m_cellSize);
        });
        return reconstruct(pilot.render(block, seed), out.sums);
    }
    const Scene& m_scene;
    const RenderContext& m_context;
    const int m_samplesPerPixel;
    const float m_cellSize;
    PerThread<ThreadPilot> m_threads;
};

/// Returns blocks of pixels that are spread evenly over the pixel bounds.
std::vector<PixelBounds> blocksIn(const PixelBounds& bounds, int count, int size) {
    // The steps of the R2 sequence: 1/g and 1/g², where g³ = g + 1.
    constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;
    const auto position = [](int i, double step, int length) {
        const double x = 0.5 + i * step;
        return int((x - std::floor(x)) * std::max(length, 1));
    };
    std::vector<PixelBounds> blocks;
    for (int i = 0; i < count; ++i) {
        const int x = bounds.x0 + position(i, kStepX, bounds.width() - size);
        const int y = bounds.y0 + position(i, kStepY, bounds.height() - size);
        blocks.push_back({x, y, std::min(x + size, bounds.x1), std::min(y + size, bounds.y1)});
    }
    return blocks;
}

/// Returns the time for recording and reconstruction relative to that of the render. The times are those of a
/// 3 GHz core on the scenes of this project: they decide about pixels, so that they cannot be measured here.
double overheadOf(const Scene& scene, double samplesPerPixel, const BlockSums& sums) {
    // Nanoseconds per sample, per sample with a first vertex, and per pixel:
    constexpr double kObserve = 30, kRecord = 60, kFinishPixel = 700, kReconstructPixel = 350;
    // The cost of a sample, of its rays with their share of shading, and of texture lookups:
    constexpr double kSample = 30, kSimplestRay = 29, kRayPerDoubledGeometry = 3.1, kFootprint = 250;
    const TracerCounts& geometry = scene.tracer().counts();
    const double primitives = double(geometry.triangles + geometry.quadrics);
    const double ray = kSimplestRay + kRayPerDoubledGeometry * std::log2(1 + primitives);
    const double samples = double(std::max<uint64_t>(sums.counters.visibilitySamples, 1));
    const double recorded = sums.recorded / samples;
    return (kObserve + kRecord * recorded + (kFinishPixel + kReconstructPixel * recorded) / samplesPerPixel) /
           (kSample +
            (ray * double(sums.counters.rays()) + kFootprint * double(sums.counters.footprints)) / samples);
}

/// Returns true if the first render of the blocks shows that sharing cannot pay. The gain that LightSharing
/// estimates is up to three times too large. An estimated gain that hardly exceeds the ratio of the times
/// therefore decides against sharing. Gains below kNoPromise do not decide: a few bright samples can hide the
/// real gain.
bool isHopeless(std::span<const BlockPilot> pilots, double overhead) {
    constexpr double kLeastPromise = 1.25, kNoPromise = 1.5;
    double own = 0, shared = 0;
    for (const BlockPilot& pilot : pilots) {
        const double weight = weightOf(meanOf(pilot.first.images[0], INFINITY));
        own += weight * pilot.first.ownVariance;
        shared += weight * pilot.first.variance;
    }
    return own > kNoPromise * shared && own < kLeastPromise * (1 + overhead) * shared;
}

/// What the blocks say about sharing.
struct Verdict {
    LightParts parts;      ///< to share
    bool isCertain = true; ///< hardly depends on the choice of the blocks
};

/// The gain of sharing some parts of the light, measured on the pilot's blocks.
struct SharingGain {
    LightParts parts;
    double sum = 0, deviation = 0; ///< the sum of the gains of the blocks, and its standard error
};

/// Returns the gain of the parts that leave the least cost if they are shared. `cost` maps the error of a
/// block to its cost. The gain of a block is its cost without sharing minus `least` times its cost with it.
template <class Cost>
SharingGain gainOf(std::span<const BlockPilot> pilots, size_t clip, double least, const Cost& cost) {
    double costs[kChoiceCount] = {};
    for (const BlockPilot& pilot : pilots)
        for (size_t choice = 0; choice < kChoiceCount; ++choice)
            costs[choice] += cost(pilot.errors[clip][choice]);
    const size_t best = size_t(std::min_element(costs + 1, costs + kChoiceCount) - costs);
    SharingGain out{kChoices[best]};
    double squares = 0;
    for (const BlockPilot& pilot : pilots) {
        const double(&errors)[kChoiceCount] = pilot.errors[clip];
        const double gain = cost(errors[0]) - least * cost(errors[best]);
        out.sum += gain;
        squares += sqr(gain);
    }
    const double count = double(pilots.size());
    out.deviation = std::sqrt(count / (count - 1) * std::max(squares - sqr(out.sum) / count, 0.));
    return out;
}

/// Decides for the parts whose sharing leaves the least error, by the first of kClips for which this pays:
/// for which the error per time falls by more than a fifth, and by more than half of the standard error of
/// the blocks' sum. If there is none, the roots of the errors decide about indirect light, so that a single
/// block does not: with the best distribution of samples, the product of error and time is the square of
/// their sum (Neyman allocation, for errors in proportion to 1/n; those of direct light fall faster). They
/// need no margin, as blocks without neighbors gain less than the image. `overhead`: see overheadOf.
Verdict decide(std::span<const BlockPilot> pilots, double overhead) {
    constexpr double kMargin = 1.2, kStandardErrors = 0.5, kCertain = 1;
    Verdict verdict;
    const auto pays = [&](const SharingGain& gain) {
        const bool isCertain = std::abs(gain.sum) >= kCertain * gain.deviation;
        if (gain.sum > kStandardErrors * gain.deviation) {
            verdict = {gain.parts, isCertain};
            return true;
        }
        verdict.isCertain = verdict.isCertain && isCertain;
        return false;
    };
    const double least = kMargin * (1 + overhead);
    for (size_t clip = 0; clip < std::size(kClips); ++clip)
        if (pays(gainOf(pilots, clip, least, [](double error) { return error; })))
            return verdict;
    const SharingGain gain = gainOf(pilots, std::size(kClips) - 1, std::sqrt(1 + overhead),
                                    [](double error) { return std::sqrt(std::max(error, 0.)); });
    if (gain.parts.has(LightPart::Indirect))
        pays(gain);
    return verdict;
}

} // namespace

SharingPlan planSharing(const Scene& scene, const RenderContext& context, float cellSize,
                        const std::optional<LightParts>& chosen) {
    constexpr int kBlockSize = 8, kMinSamples = 16, kMaxSamples = 64, kMinBlocks = 8, kMaxBlocks = 64;
    constexpr double kPilotShare = 0.004, kPasses = 64; // the samples of passes, whose number is not known
    // The fraction of the samples that are recorded one by one falls with their number, so that the limits
    // rise.
    constexpr double kMaxRare = 0.005;
    const double samples = context.isPass ? kPasses : context.samplesPerPixel;
    if (samples < kHalves)
        return {chosen.value_or(LightParts()), {}, {}};
    // Direct light converges faster than in proportion to the samples, so that few would mislead.
    const int pilotSamples =
        int(std::min(samples, std::clamp(samples / 2, double(kMinSamples), double(kMaxSamples))));
    const PixelBounds& bounds = context.pilotBounds;
    const double pixels = double(bounds.width()) * bounds.height();
    const int affordable = int(kPilotShare * pixels * samples / (kBlockSize * kBlockSize * pilotSamples));
    const size_t count = size_t(std::clamp(affordable, kMinBlocks, kMaxBlocks));
    // An uncertain verdict is worth twice as many blocks where this is not much of the render.
    const size_t limit = affordable >= kMinBlocks / 2 ? 2 * count : count;
    const auto blocks = blocksIn(bounds, int(limit), kBlockSize);
    BlockRenderer renderer(scene, context, pilotSamples, cellSize);
    std::vector<BlockPilot> pilots;
    BlockSums sums;
    Verdict verdict;
    do {
        const size_t first = pilots.size();
        pilots.resize(first + count);
        parallelFor(count, [&](size_t i) { renderer.renderFirst(blocks[first + i], pilots[first + i]); });
        if (first == 0 && !chosen) {
            BlockSums ofFirst;
            for (const BlockPilot& pilot : pilots)
                ofFirst.add(pilot.sums);
            if (isHopeless(pilots, overheadOf(scene, samples, ofFirst)))
                return {};
        }
        parallelFor(count, [&](size_t i) { renderer.measure(blocks[first + i], pilots[first + i]); });
        for (size_t i = first; i < pilots.size(); ++i)
            sums.add(pilots[i].sums);
        verdict = decide(pilots, overheadOf(scene, samples, sums));
    } while (pilots.size() < limit && !verdict.isCertain);
    SharingPlan plan;
    plan.rareLimits = renderer.brightness().limits(std::min(kMaxRare, 1 / samples));
    plan.parts = chosen.value_or(verdict.parts);
    plan.emission = {sums.variance / sums.pixels * pilotSamples / samples,
                     sums.emissionCoefficient / sums.pixels};
    return plan;
}

} // namespace strobe
