#include "sharing/noise_pilot.h"

#include "core/util/parallel.h"
#include "sharing/light_recorder.h"
#include "sharing/reconstruction.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr LightPart kAllParts[kParts] = {LightPart::Direct, LightPart::Indirect};

/// Squared errors relative to the radiance of their pixels, summed over pixels.
struct PartErrors {
    double own = 0;   ///< of the pixels' own estimates
    double mixed = 0; ///< with sharing
};

/// The errors and the counters of one block, or sums over blocks.
struct BlockErrors {
    PartErrors parts[kParts];
    double pixels = 0;
    double mixed = 0;               ///< squared error with sharing, not relative
    double emissionCoefficient = 0; ///< see EmissionPilot; times pixels
    Counters counters;
    PartErrors& of(LightPart part) { return parts[int(part)]; }
    void add(const BlockErrors& other) {
        for (int part = 0; part < kParts; ++part) {
            parts[part].own += other.parts[part].own;
            parts[part].mixed += other.parts[part].mixed;
        }
        pixels += other.pixels;
        mixed += other.mixed;
        emissionCoefficient += other.emissionCoefficient;
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
    PilotWorker(const Scene& scene, float cellSize, float clamp, Brightness& brightness)
        : RecordingWorker(scene, cellSize, clamp, LightParts::all()), m_brightness(brightness) {}
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

/// The pilot of a block of pixels.
class PilotState : public IntegratorState {
  public:
    PilotState(const Scene& scene, float cellSize, float clamp, Brightness& brightness)
        : m_scene(scene), m_cellSize(cellSize), m_clamp(clamp), m_brightness(brightness) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<PilotWorker>(m_scene, m_cellSize, m_clamp, m_brightness);
    }
    bool observes() const override { return true; }

  private:
    const Scene& m_scene;
    const float m_cellSize, m_clamp;
    Brightness& m_brightness;
};

/// The radiance of a pixel without the emission that camera rays hit; mean of the channels.
float reflectedRadiance(const RecordedLight& light, size_t pixel) {
    const HalfPixelSums &a = light.pixel(pixel, 0), &b = light.pixel(pixel, 1);
    const Rgb emitted = a.emitted + b.emitted;
    return (a.v + b.v - (emitted.x + emitted.y + emitted.z) / 3) / float(a.count + b.count);
}

/// `dependence`: the factor by which the error of the mixture exceeds that of a mixture of independent
/// estimates.
void addErrors(const std::vector<float>& radiance, const SharedPart& part, float dependence, LightPart which,
               BlockErrors& errors) {
    constexpr float kDark = 0.01f; // radiance below which errors do not count as relative ones
    for (size_t i = 0; i < part.variance.size(); ++i) {
        const float weight = 1 / (sqr(radiance[i]) + sqr(kDark)), own = part.ownVariance[i] * weight;
        if (!std::isfinite(own))
            continue;
        errors.mixed += double(part.variance[i]);
        errors.of(which).own += double(own);
        errors.of(which).mixed += double(std::min(own, dependence * part.variance[i] * weight));
    }
}

/// What the pilot of a block found out.
struct BlockPilot {
    BlockErrors errors;
    Brightness brightness;
};

BlockPilot renderBlock(const Scene& scene, const RenderContext& context, const PixelBounds& block,
                       int samplesPerPixel, float cellSize) {
    BlockPilot out;
    PilotState pilot(scene, cellSize, context.clamp, out.brightness);
    Film film(block.x1, block.y1, block);
    out.errors.counters = context.renderPilot(pilot, film, samplesPerPixel);
    RecordedLight light(film);
    std::vector<float> radiance(light.pixels.size() / kHalves);
    for (size_t i = 0; i < radiance.size(); ++i)
        radiance[i] = reflectedRadiance(light, i);
    out.errors.pixels = double(radiance.size());
    out.errors.emissionCoefficient = out.errors.pixels * emissionPilot(light).coefficient;
    const LightSharing sharing(std::move(light));
    addErrors(radiance, sharing.share(LightPart::Direct), 3, LightPart::Direct, out.errors);
    addErrors(radiance, sharing.share(LightPart::Indirect), 1.5f, LightPart::Indirect, out.errors);
    return out;
}

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
double overheadOf(const Scene& scene, double samplesPerPixel, const Counters& counters) {
    constexpr double kRecordSample = 55, kReconstructPixel = 1200;    // nanoseconds
    constexpr double kSimplestRay = 25, kRayPerDoubledGeometry = 2.7; // with its share of shading
    const TracerCounts& geometry = scene.tracer().counts();
    const double primitives = double(geometry.triangles + geometry.quadrics);
    const double ray = kSimplestRay + kRayPerDoubledGeometry * std::log2(1 + primitives);
    const double raysPerSample =
        double(counters.rays()) / double(std::max<uint64_t>(counters.visibilitySamples, 1));
    return (kRecordSample + kReconstructPixel / samplesPerPixel) / (ray * raysPerSample);
}

} // namespace

SharingPlan planSharing(const Scene& scene, const RenderContext& context, float cellSize) {
    constexpr int kBlockSize = 12, kMinSamples = 16, kMaxSamples = 64, kMaxBlocks = 64;
    constexpr double kPilotShare = 0.02, kPasses = 64; // the samples of passes, whose number is not known
    constexpr double kMinGain = 0.1; // of the error that is left; less is not worth the time
    // The fraction of the samples that are recorded one by one falls with their number, so that the limits
    // rise.
    constexpr double kMaxRare = 0.005;
    const double samples = context.isPass ? kPasses : context.samplesPerPixel;
    if (samples < kHalves)
        return {};
    // Direct light converges faster than in proportion to the samples, so that few would mislead.
    const int pilotSamples =
        int(std::min(samples, std::clamp(samples / 2, double(kMinSamples), double(kMaxSamples))));
    const PixelBounds& bounds = context.pilotBounds;
    const double pixels = double(bounds.width()) * bounds.height();
    const double count = kPilotShare * pixels * samples / (kBlockSize * kBlockSize * pilotSamples);
    const auto blocks = blocksIn(bounds, std::clamp(int(count), 1, kMaxBlocks), kBlockSize);
    std::vector<BlockPilot> pilots(blocks.size());
    parallelFor(blocks.size(), [&](size_t i) {
        pilots[i] = renderBlock(scene, context, blocks[i], pilotSamples, cellSize);
    });
    BlockErrors errors;
    Brightness brightness;
    for (const BlockPilot& pilot : pilots) {
        errors.add(pilot.errors);
        brightness.add(pilot.brightness);
    }
    SharingPlan plan;
    plan.rareLimits = brightness.limits(std::min(kMaxRare, 1 / samples));
    double own = 0, mixed = 0;
    for (const LightPart part : kAllParts) {
        own += errors.of(part).own;
        mixed += errors.of(part).mixed;
    }
    for (const LightPart part : kAllParts)
        if (errors.of(part).own - errors.of(part).mixed > kMinGain * mixed)
            plan.parts.add(part);
    if (!(own > (1 + 2 * overheadOf(scene, samples, errors.counters)) * mixed))
        plan.parts = {};
    plan.emission = {errors.mixed / errors.pixels * pilotSamples / samples,
                     errors.emissionCoefficient / errors.pixels};
    return plan;
}

} // namespace strobe
