#include "sharing/noise_pilot.h"

#include "core/util/parallel.h"
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
    PilotWorker(const Scene& scene, RecordedLight& out, float cellSize, float clamp, Brightness& brightness)
        : RecordingWorker(scene, out, cellSize, clamp, {}), m_brightness(brightness) {}
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

/// The pilot of one block of pixels.
class PilotState : public IntegratorState {
  public:
    PilotState(const Scene& scene, const RenderContext& context, const PixelBounds& block, float cellSize)
        : m_scene(scene), m_cellSize(cellSize), m_clamp(context.clamp), m_light(block) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<PilotWorker>(m_scene, m_light, m_cellSize, m_clamp, m_brightness);
    }
    bool observes() const override { return true; }
    const Brightness& brightness() const { return m_brightness; }
    /// Returns the errors of the rendered block.
    BlockErrors errors() const {
        const LightSharing sharing(m_light);
        BlockErrors errors;
        // The factors by which the error of the mixture exceeds that of a mixture of independent estimates.
        addErrors(sharing.share(LightPart::Direct), 3, LightPart::Direct, errors);
        addErrors(sharing.share(LightPart::Indirect), 1.5f, LightPart::Indirect, errors);
        errors.pixels = double(m_light.pixels.size()) / kHalves;
        errors.emissionCoefficient = errors.pixels * emissionPilot(m_light).coefficient;
        return errors;
    }

  private:
    void addErrors(const SharedPart& part, float dependence, LightPart which, BlockErrors& errors) const {
        constexpr float kDark = 0.01f; // radiance below which errors do not count as relative ones
        for (size_t i = 0; i < part.variance.size(); ++i) {
            const HalfPixelSums &a = m_light.pixel(i, 0), &b = m_light.pixel(i, 1);
            const Rgb emitted = a.emitted + b.emitted;
            const float radiance =
                (a.v + b.v - (emitted.x + emitted.y + emitted.z) / 3) / float(a.count + b.count);
            const float weight = 1 / (sqr(radiance) + sqr(kDark)), own = part.ownVariance[i] * weight;
            if (!std::isfinite(own))
                continue;
            errors.mixed += double(part.variance[i]);
            errors.of(which).own += double(own);
            errors.of(which).mixed += double(std::min(own, dependence * part.variance[i] * weight));
        }
    }

    const Scene& m_scene;
    const float m_cellSize, m_clamp;
    RecordedLight m_light;
    Brightness m_brightness;
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
    const double pixels = double(context.pixelBounds.width()) * context.pixelBounds.height();
    const double count = kPilotShare * pixels * samples / (kBlockSize * kBlockSize * pilotSamples);
    const auto blocks = blocksIn(context.pixelBounds, std::clamp(int(count), 1, kMaxBlocks), kBlockSize);
    std::vector<BlockErrors> errorsOfBlocks(blocks.size());
    std::vector<Brightness> brightnessOfBlocks(blocks.size());
    parallelFor(blocks.size(), [&](size_t i) {
        PilotState pilot(scene, context, blocks[i], cellSize);
        const Counters counters = context.renderPilot(pilot, blocks[i], pilotSamples);
        errorsOfBlocks[i] = pilot.errors();
        errorsOfBlocks[i].counters = counters;
        brightnessOfBlocks[i] = pilot.brightness();
    });
    Brightness brightness;
    for (const Brightness& block : brightnessOfBlocks)
        brightness.add(block);
    SharingPlan plan;
    plan.rareLimits = brightness.limits(std::min(kMaxRare, 1 / samples));
    BlockErrors errors;
    for (const BlockErrors& block : errorsOfBlocks)
        errors.add(block);
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
