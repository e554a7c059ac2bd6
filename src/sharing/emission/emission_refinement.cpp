#include "sharing/emission/emission_refinement.h"

#include "core/render/visibility_tracer.h"
#include "core/util/parallel.h"

#include <bit>

namespace strobe {

/// Sums over samples of the emission e and the radiance v of a pixel or several.
struct EmissionMoments {
    float count = 0, v = 0, e = 0, ee = 0, ve = 0;
    void add(const PixelEmission::Half& half, int32_t weight, float radiance) {
        count += float(weight);
        v += radiance;
        e += (half.emitted.x + half.emitted.y + half.emitted.z) / 3;
        ee += half.ee;
        ve += half.ve;
    }
    void add(const EmissionMoments& other) {
        count += other.count;
        e += other.e;
        ee += other.ee;
    }
    void addEmission(float emission) {
        ++count;
        e += emission;
        ee += sqr(emission);
    }
    float variance() const { return count > 0 ? std::max(ee / count - sqr(e / count), 0.f) : 0; }
    float covariance() const { return count > 0 ? ve / count - e * v / sqr(count) : 0; }
};

/// Tells whether camera rays may see emission, so that few of those that see none are traced.
class VisibleEmission {
  public:
    explicit VisibleEmission(const Scene& scene)
        : m_isEverywhere(scene.showsBackground() && !scene.environments().empty()) {
        for (const auto& light : scene.lights())
            if (!light->isDelta() && !light->isEnvironment())
                m_lights.push_back(light.get());
        m_isEverywhere |= m_lights.size() > kMaxTested;
    }
    /// Returns false only if none of the samples, which need not be traced, sees emission.
    bool mayBeSeen(const SoAVector<VisibilitySoA>& samples) const {
        for (size_t c = 0; c < samples.chunks() && !m_isEverywhere; ++c) {
            const VisibilitySoA& chunk = samples.chunk(c);
            const int n = samples.chunkSize(c);
            for (const Light* light : m_lights)
                for (int i = 0; i < n; ++i)
                    if (light->mayIntersect(chunk.ray.o.at(i), chunk.camera.time[i], chunk.ray.d.at(i)))
                        return true;
        }
        return m_isEverywhere;
    }

  private:
    static constexpr size_t kMaxTested = 8; ///< tests of more lights take as long as tracing
    bool m_isEverywhere;
    std::vector<const Light*> m_lights; ///< that rays can hit
};

namespace {

/// The cost of a visibility sample relative to that of a shaded one.
constexpr double kRelativeCost = 0.25;
/// The largest cost of this step relative to that of the render.
constexpr double kMaxCost = 0.05;
constexpr uint32_t kMaxSamplesPerPixel = 1 << 20;
constexpr uint32_t kBatchSamples = 2048;
/// Distinguish the random numbers of this step from those of the render.
constexpr uint64_t kSeedOfProbes = 0x70726f62, kSeedOfSamples = 0x656d6974;

/// The noise of emission in one half of a pixel, estimated from the other half and from neighboring pixels.
struct EmissionNoise {
    float coefficient; ///< of the regression of radiance on emission, in [0,1]
    float deviation;   ///< standard deviation of the emission of a sample
};

/// Within a pixel and its neighbors, variances and covariances are those around each pixel's mean. The
/// coefficient is 1 if the emission of these samples does not vary.
EmissionNoise noiseFromOthers(const RecordedLight& light, int x, int y, int half) {
    const int width = light.pixelBounds.width(), height = light.pixelBounds.height();
    float variance = 0, covariance = 0;
    for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v) {
        const size_t row = size_t(v) * size_t(width);
        for (const PixelEmission& pixel : light.emissionOf(row + size_t(std::max(0, x - 1)),
                                                           row + size_t(std::min(width - 1, x + 1)) + 1)) {
            const bool isSame = pixel.pixel == size_t(y) * size_t(width) + size_t(x);
            EmissionMoments moments;
            for (int h = 0; h < kHalves; ++h)
                if (!isSame || h != half)
                    moments.add(pixel.halves[h], light.weights(pixel.pixel, h).all,
                                light.radiance(pixel.pixel, h));
            const float weight = isSame ? 1.f : 0.125f;
            variance += weight * moments.variance();
            covariance += weight * moments.covariance();
        }
    }
    if (!(variance > 0))
        return {1, 0}; // right for emission much brighter than what it hides
    const float coefficient = std::clamp(covariance / variance, 0.f, 1.f);
    return {coefficient, std::sqrt(variance)};
}

/// Distributes samples in proportion to the standard deviations (Neyman allocation). Their number b minimizes
/// the product of error and time, (otherError + deviations²/b) (samples of the render + kRelativeCost b).
/// Returns no samples if that gains less than minGain.
HugeVector<uint32_t> distribute(const HugeVector<float>& deviations, int samplesPerPixel,
                                const EmissionPilot& pilot) {
    const double own = samplesPerPixel, samples = own * double(deviations.size());
    const double otherError = pilot.otherError * double(deviations.size());
    double sum = 0, error = 0;
    for (const float deviation : deviations) {
        sum += double(deviation);
        error += sqr(double(deviation)) / own;
    }
    if (sum == 0)
        return {};
    double budget = kMaxCost / kRelativeCost * samples;
    if (otherError > 0)
        budget = std::min(budget, sum * std::sqrt(samples / (kRelativeCost * otherError)));
    const double timeFactor = 1 + kRelativeCost * budget / samples;
    if ((otherError + sqr(sum) / budget) * timeFactor * pilot.minGain > otherError + error)
        return {};
    HugeVector<uint32_t> out(deviations.size(), 0);
    for (size_t i = 0; i < out.size(); ++i)
        if (const double share = budget * double(deviations[i]) / sum; share >= own)
            out[i] = std::bit_floor(uint32_t(std::min(share, double(kMaxSamplesPerPixel))));
    return out;
}

} // namespace

Rgb emissionOf(const Scene& scene, const VisibilitySample& sample) {
    if (!sample.hit)
        return scene.showsBackground() ? scene.environment(sample.ray.d) : Rgb(0);
    if (!scene.emits(sample.hit))
        return Rgb(0);
    return scene.emitted(scene.surface(sample.hit, sample.ray.time), sample.hit, -sample.ray.d);
}

EmissionRefinement::EmissionRefinement(const Scene& scene, const CameraSampling& sampling,
                                       const PixelBounds& bounds, int samplesPerPixel,
                                       const EmissionPilot& pilot)
    : m_scene(scene), m_sampling(sampling), m_bounds(bounds) {
    HugeVector<float> deviations = findDeviations(samplesPerPixel);
    for (float& deviation : deviations)
        deviation *= float(pilot.coefficient);
    m_samples = distribute(deviations, samplesPerPixel, pilot);
    if (!isEmpty())
        markNeighbors();
}

/// Returns the standard deviation of the emission of a sample, by pixel, over the pixel and its neighbors; an
/// empty vector: no pixel may have emission.
HugeVector<float> EmissionRefinement::findDeviations(int samplesPerPixel) const {
    const auto probes = uint32_t(std::clamp(samplesPerPixel / 32, 1, 8));
    const int width = m_bounds.width(), height = m_bounds.height();
    std::vector<MomentsOfRow> rows(static_cast<size_t>(height));
    const VisibleEmission emission(m_scene);
    parallelFor(rows.size(), [&](size_t row) { rows[row] = probeRow(int(row), probes, emission); });
    if (std::all_of(rows.begin(), rows.end(), [](const MomentsOfRow& row) { return row.empty(); }))
        return {};
    HugeVector<float> deviations(size_t(width) * rows.size());
    parallelFor(rows.size(), [&](size_t row) {
        const size_t first = row > 0 ? row - 1 : 0, last = std::min(rows.size() - 1, row + 1);
        for (int x = 0; x < width; ++x) {
            EmissionMoments sum;
            for (size_t v = first; v <= last; ++v)
                for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u)
                    if (rows[v].empty())
                        sum.count += float(probes);
                    else
                        sum.add(rows[v][size_t(u)]);
            deviations[row * size_t(width) + size_t(x)] = std::sqrt(sum.variance());
        }
    });
    return deviations;
}

/// Returns the moments of the emission of camera samples of each pixel of a row; an empty vector: none of
/// them may have emission.
EmissionRefinement::MomentsOfRow EmissionRefinement::probeRow(int row, uint32_t probes,
                                                              const VisibleEmission& visible) const {
    std::vector<PixelRef> pixels;
    for (int x = m_bounds.x0, y = m_bounds.y0 + row; x < m_bounds.x1; ++x)
        pixels.push_back({x, y, pixelDomain(hashOf(m_sampling.seed, kSeedOfProbes), x, y)});
    VisibilityTracer tracer(m_scene, m_sampling.sampler, m_sampling.filter, probes, {0, probes});
    SoAVector<VisibilitySoA> samples;
    tracer.generate(pixels, samples);
    if (!visible.mayBeSeen(samples))
        return {};
    tracer.trace(samples);
    MomentsOfRow out(pixels.size());
    for (const VisibilitySample& sample : samples) {
        const Rgb emission = emissionOf(m_scene, sample) * sample.weight;
        out[sample.pixel].addEmission((emission.x + emission.y + emission.z) / 3);
    }
    return out;
}

bool EmissionRefinement::contains(const PixelRef& pixel) const {
    return pixel.x >= m_bounds.x0 && pixel.x < m_bounds.x1 && pixel.y >= m_bounds.y0 && pixel.y < m_bounds.y1;
}

size_t EmissionRefinement::indexOf(const PixelRef& pixel) const {
    return size_t(pixel.y - m_bounds.y0) * size_t(m_bounds.width()) + size_t(pixel.x - m_bounds.x0);
}

uint32_t EmissionRefinement::samplesOf(const PixelRef& pixel) const {
    return !isEmpty() && contains(pixel) ? m_samples[indexOf(pixel)] : 0;
}

bool EmissionRefinement::isNear(const PixelRef& pixel) const {
    return !isEmpty() && contains(pixel) && m_isNear[indexOf(pixel)];
}

void EmissionRefinement::markNeighbors() {
    m_isNear.resize(m_samples.size());
    const int width = m_bounds.width(), height = m_bounds.height();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (m_samples[size_t(y) * size_t(width) + size_t(x)] == 0)
                continue;
            for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
                for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u)
                    m_isNear[size_t(v) * size_t(width) + size_t(u)] = true;
        }
}

PixelAccumulator EmissionRefinement::trace(const PixelRef& pixel) const {
    const PixelRef refined{pixel.x, pixel.y, hashCombine(pixel.domain, kSeedOfSamples)};
    const uint32_t count = samplesOf(pixel);
    PixelAccumulator sum;
    SoAVector<VisibilitySoA> samples;
    for (uint32_t first = 0; first < count; first += kBatchSamples) {
        VisibilityTracer tracer(m_scene, m_sampling.sampler, m_sampling.filter, count,
                                {first, std::min(count, first + kBatchSamples)});
        tracer.generate(std::span(&refined, 1), samples);
        tracer.trace(samples);
        for (const VisibilitySample& sample : samples)
            sum.add(emissionOf(m_scene, sample), sample.weight);
    }
    return sum;
}

double emissionCoefficient(const RecordedLight& light) {
    const int width = light.pixelBounds.width(), height = light.pixelBounds.height();
    double all = 0, inRadiance = 0;
    if (light.emission.empty())
        return 1;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int half = 0; half < kHalves; ++half) {
                const EmissionNoise noise = noiseFromOthers(light, x, y, half);
                all += double(noise.deviation);
                inRadiance += double(noise.coefficient * noise.deviation);
            }
    return all > 0 ? inRadiance / all : 1;
}

std::vector<PixelCorrection> emissionCorrections(const RecordedLight& light) {
    const int width = light.pixelBounds.width();
    std::vector<PixelCorrection> corrections(light.refined.size());
    parallelForRuns(corrections.size(), [&](size_t i) {
        const EmissionSum& refined = light.refined[i];
        const size_t pixel = refined.pixel;
        const int x = int(pixel % size_t(width)), y = int(pixel / size_t(width));
        const float own = float(light.weight(pixel));
        const auto recorded = light.emissionOf(pixel, pixel + 1);
        const float more = float(refined.sum.weight());
        Rgb correction(0);
        float replaced = 0;
        for (int half = 0; half < kHalves; ++half) {
            const float weight = float(light.weights(pixel, half).all);
            if (!(weight > 0) || !(own > 0))
                continue;
            const Rgb emitted = recorded.empty() ? Rgb(0) : recorded.front().halves[half].emitted;
            const Rgb difference = refined.sum.mean() - emitted * (1 / weight);
            const float coefficient = noiseFromOthers(light, x, y, half).coefficient;
            const float fraction = coefficient * more / (own + more) * weight / own;
            correction += difference * fraction;
            replaced += fraction;
        }
        corrections[i] = {pixel, correction, replaced};
    });
    return corrections;
}

} // namespace strobe
