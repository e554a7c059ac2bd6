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
    Counters counters;
    PartErrors& of(LightPart part) { return parts[int(part)]; }
    void add(const BlockErrors& other) {
        for (int part = 0; part < kParts; ++part) {
            parts[part].own += other.parts[part].own;
            parts[part].mixed += other.parts[part].mixed;
        }
        counters.add(other.counters);
    }
};

/// The pilot of a block of pixels.
class PilotState : public IntegratorState {
  public:
    PilotState(const Scene& scene, float cellSize, float clamp)
        : m_scene(scene), m_cellSize(cellSize), m_clamp(clamp) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<RecordingWorker>(m_scene, m_cellSize, m_clamp, LightParts::all());
    }
    bool observes() const override { return true; }

  private:
    const Scene& m_scene;
    const float m_cellSize, m_clamp;
};

void addErrors(const RecordedLight& light, const SharedPart& part, float dependence, PartErrors& errors) {
    constexpr float kDark = 0.01f; // radiance below which errors do not count as relative ones
    for (size_t i = 0; i < part.variance.size(); ++i) {
        const HalfPixelSums &a = light.pixel(i, 0), &b = light.pixel(i, 1);
        const Rgb emitted = a.emitted + b.emitted;
        const float radiance =
            (a.v + b.v - (emitted.x + emitted.y + emitted.z) / 3) / float(a.count + b.count);
        const float weight = 1 / (sqr(radiance) + sqr(kDark)), own = part.ownVariance[i] * weight;
        if (!std::isfinite(own))
            continue;
        errors.own += double(own);
        errors.mixed += double(std::min(own, dependence * part.variance[i] * weight));
    }
}

/// Renders a block of pixels and returns its errors.
BlockErrors measureBlock(const Scene& scene, const RenderContext& context, const PixelBounds& block,
                         int samplesPerPixel, float cellSize) {
    PilotState pilot(scene, cellSize, context.clamp);
    Film film(block.x1, block.y1, block);
    BlockErrors errors;
    errors.counters = context.renderPilot(pilot, film, samplesPerPixel);
    const RecordedLight light(film);
    const LightSharing sharing(light);
    // The factors by which the error of the mixture exceeds that of a mixture of independent estimates.
    addErrors(light, sharing.share(LightPart::Direct), 3, errors.of(LightPart::Direct));
    addErrors(light, sharing.share(LightPart::Indirect), 1.5f, errors.of(LightPart::Indirect));
    return errors;
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

LightParts chooseParts(const Scene& scene, const RenderContext& context, float cellSize) {
    constexpr int kBlockSize = 12, kMinSamples = 16, kMaxSamples = 64, kMaxBlocks = 64;
    constexpr double kPilotShare = 0.02, kPasses = 64; // the samples of passes, whose number is not known
    constexpr double kMinGain = 0.1; // of the error that is left; less is not worth the time
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
    std::vector<BlockErrors> errorsOfBlocks(blocks.size());
    parallelFor(blocks.size(), [&](size_t i) {
        errorsOfBlocks[i] = measureBlock(scene, context, blocks[i], pilotSamples, cellSize);
    });
    BlockErrors errors;
    for (const BlockErrors& block : errorsOfBlocks)
        errors.add(block);
    double own = 0, mixed = 0;
    for (const LightPart part : kAllParts) {
        own += errors.of(part).own;
        mixed += errors.of(part).mixed;
    }
    LightParts parts;
    for (const LightPart part : kAllParts)
        if (errors.of(part).own - errors.of(part).mixed > kMinGain * mixed)
            parts.add(part);
    return own > (1 + 2 * overheadOf(scene, samples, errors.counters)) * mixed ? parts : LightParts{};
}

} // namespace strobe
