#include "sharing/emission_refinement.h"

#include "core/render/visibility_tracer.h"
#include "core/util/parallel.h"

#include <bit>

namespace strobe {

namespace {

/// The cost of a visibility sample relative to that of a shaded one.
constexpr double kRelativeCost = 0.25;
/// The largest cost of this step relative to that of the render.
constexpr double kMaxCost = 0.05;
constexpr uint32_t kMaxSamplesPerPixel = 1 << 20;
constexpr uint32_t kBatchSamples = 2048;
/// Distinguishes the random numbers of this step from those of the render.
constexpr uint64_t kSeedOfStep = 0x656d6974;

/// Means over samples of the emission e and the radiance v of a pixel or several.
struct Moments {
    float count = 0, v = 0, e = 0, ee = 0, ve = 0;
    void add(const HalfPixelSums& sums) {
        count += float(sums.count);
        v += sums.v;
        e += (sums.emitted.x + sums.emitted.y + sums.emitted.z) / 3;
        ee += sums.ee;
        ve += sums.ve;
    }
    float variance() const { return count > 0 ? std::max(ee / count - sqr(e / count), 0.f) : 0; }
    float covariance() const { return count > 0 ? ve / count - e * v / sqr(count) : 0; }
};

/// The noise of emission in one half of a pixel, estimated from the other half and from neighboring pixels.
struct EmissionNoise {
    float coefficient = 0; ///< of the regression of radiance on emission, in [0,1]
    float deviation = 0;   ///< standard deviation of the emission of a sample, times the coefficient
};

/// Within a pixel and its neighbors, variances and covariances are those around each pixel's mean.
EmissionNoise noiseFromOthers(const RecordedLight& light, int x, int y, int half) {
    const int width = light.pixelBounds.width(), height = light.pixelBounds.height();
    float variance = 0, covariance = 0;
    for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
            const size_t pixel = size_t(v) * size_t(width) + size_t(u);
            const bool isSame = u == x && v == y;
            Moments moments;
            for (int h = 0; h < kHalves; ++h)
                if (!isSame || h != half)
                    moments.add(light.pixel(pixel, h));
            const float weight = isSame ? 1.f : 0.125f;
            variance += weight * moments.variance();
            covariance += weight * moments.covariance();
        }
    if (!(variance > 0))
        return {};
    const float coefficient = std::clamp(covariance / variance, 0.f, 1.f);
    return {coefficient, coefficient * std::sqrt(variance)};
}

Rgb emissionOf(const Scene& scene, const VisibilitySample& sample) {
    if (!sample.hit)
        return scene.environment(sample.ray.d);
    if (!scene.emits(sample.hit))
        return Rgb(0);
    return scene.emitted(scene.surface(sample.hit, sample.ray.time), sample.hit, -sample.ray.d);
}

/// Returns the mean emission of `count` new camera samples of a pixel.
Rgb sampleEmission(const Scene& scene, const CameraSampling& sampling, const PixelRef& pixel,
                   uint32_t count) {
    PixelAccumulator sum;
    SoAVector<VisibilitySoA> samples;
    for (uint32_t first = 0; first < count; first += kBatchSamples) {
        VisibilityTracer tracer(scene, sampling.sampler, sampling.filter, count,
                                {first, std::min(count, first + kBatchSamples)});
        tracer.generate(std::span(&pixel, 1), samples);
        tracer.trace(samples);
        for (const VisibilitySample& sample : samples)
            sum.add(emissionOf(scene, sample), sample.weight);
    }
    return sum.mean();
}

struct Refinement {
    size_t pixel;
    int half;
    uint32_t samples;
    float coefficient;
};

/// Distributes samples in proportion to the standard deviation (Neyman allocation). Their number b minimizes
/// the product of error and time, (otherError + deviations²/b) (recorded samples + kRelativeCost b).
std::vector<Refinement> planRefinements(const RecordedLight& light, double otherError) {
    const int width = light.pixelBounds.width();
    std::vector<EmissionNoise> noise(light.pixels.size());
    parallelFor(size_t(light.pixelBounds.height()), [&](size_t y) {
        for (int x = 0; x < width; ++x)
            for (int half = 0; half < kHalves; ++half)
                noise[kHalves * (y * size_t(width) + size_t(x)) + size_t(half)] =
                    noiseFromOthers(light, x, int(y), half);
    });
    double deviations = 0, samples = 0, error = 0;
    for (size_t i = 0; i < noise.size(); ++i) {
        const double count = light.pixels[i].count;
        deviations += double(noise[i].deviation) / kHalves;
        samples += count;
        if (count > 0)
            error += sqr(double(noise[i].deviation)) / (kHalves * kHalves * count);
    }
    std::vector<Refinement> plan;
    if (deviations == 0)
        return plan;
    double budget = kMaxCost / kRelativeCost * samples;
    if (otherError > 0)
        budget = std::min(budget, deviations * std::sqrt(samples / (kRelativeCost * otherError)));
    const double timeFactor = 1 + kRelativeCost * budget / samples;
    if ((otherError + sqr(deviations) / budget) * timeFactor > 0.95 * (otherError + error))
        return plan;
    for (size_t i = 0; i < noise.size(); ++i) {
        const double share = budget * noise[i].deviation / (deviations * kHalves);
        const uint32_t own = light.pixels[i].count;
        if (own > 0 && share >= own)
            plan.push_back({i / kHalves, int(i % kHalves),
                            std::bit_floor(uint32_t(std::min(share, double(kMaxSamplesPerPixel)))),
                            noise[i].coefficient});
    }
    return plan;
}

} // namespace

std::vector<Rgb> emissionCorrection(const Scene& scene, const CameraSampling& sampling,
                                    const RecordedLight& light, double otherError) {
    const std::vector<Refinement> plan = planRefinements(light, otherError);
    std::vector<Rgb> changes(plan.size());
    parallelFor(plan.size(), [&](size_t i) {
        const Refinement& r = plan[i];
        const int x = light.pixelBounds.x0 + int(r.pixel % size_t(light.pixelBounds.width()));
        const int y = light.pixelBounds.y0 + int(r.pixel / size_t(light.pixelBounds.width()));
        const PixelRef pixel{x, y, hashOf(sampling.seed, kSeedOfStep, x, y, r.half)};
        const HalfPixelSums& recorded = light.pixel(r.pixel, r.half);
        const float own = float(recorded.count), more = float(r.samples);
        const float other = float(light.pixel(r.pixel, 1 - r.half).count);
        const Rgb difference =
            sampleEmission(scene, sampling, pixel, r.samples) - recorded.mean(recorded.emitted);
        changes[i] = difference * (r.coefficient * more / (own + more) * own / (own + other));
    });
    std::vector<Rgb> correction(light.pixels.size() / kHalves, Rgb(0));
    for (size_t i = 0; i < plan.size(); ++i)
        correction[plan[i].pixel] += changes[i];
    return correction;
}

} // namespace strobe
