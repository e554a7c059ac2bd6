#include "core/render/passes.h"

#include "core/math/hash.h"

#include <map>

namespace strobe {

namespace {

using Clock = PassGoal::Clock;

/// How long passes take, from those that were made.
class PassTimes {
  public:
    void add(int samples, double seconds) { m_seconds[samples] = seconds; }
    /// There is a part that does not depend on the samples (points that are shaded once, however many of them
    /// share it), and what each sample adds. So: along the line through the neighboring sizes or, beyond
    /// the largest pass, through the last two; but there a sample adds a quarter of its mean share at least.
    double predict(int samples) const {
        const auto above = m_seconds.lower_bound(samples);
        if (above == m_seconds.begin() || (above != m_seconds.end() && above->first == samples))
            return above->second;
        const auto slope = [](auto a, auto b) { return (b->second - a->second) / (b->first - a->first); };
        const auto below = std::prev(above);
        if (above != m_seconds.end())
            return below->second + slope(below, above) * (samples - below->first);
        const double share = below->second / below->first;
        const double each =
            below == m_seconds.begin() ? share : std::clamp(slope(std::prev(below), below), share / 4, share);
        return below->second + each * (samples - below->first);
    }

  private:
    std::map<int, double> m_seconds; ///< of the latest pass of each size
};

double secondsUntil(Clock::time_point time) {
    return std::chrono::duration<double>(time - Clock::now()).count();
}

/// How many times the samples of the largest pass the next one has. Few passes spread samples and share
/// shades better than many; but the last one's time is told from those before, and too long a one is lost.
constexpr uint64_t kGrowth = 4;

/// How many samples the next pass may have, of at most `most`, to end in time; 0: not one.
int samplesThatFit(int most, const PassTimes& times, Clock::time_point deadline) {
    constexpr double kVariation = 1.1; // passes of one size take unequal times
    const double left = secondsUntil(deadline);
    int samples = most;
    while (samples > 0 && times.predict(samples) * kVariation > left)
        samples /= 2;
    return samples;
}

} // namespace

RenderStats renderPasses(const Scene& scene, const Integrator& integrator, const Shader& shader,
                         const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                         const PassGoal& goal, int most, Film& film, const PassDone& done) {
    std::optional<Clock::time_point> deadline = goal.deadline;
    int passes = 0; // written between passes only
    RenderSettings passSettings = settings;
    passSettings.samplesPerPixel = goal.noise ? settings.samplesPerPixel : 1;
    const auto isToldToStop = [&] { return settings.stop && settings.stop(); };
    passSettings.stop = [&] {
        return passes > 0 && ((deadline && Clock::now() > *deadline) || isToldToStop());
    };
    passSettings.onTileDone = [&](const Film& of, const PixelBounds& tile) {
        if (passes == 0 && settings.onTileDone)
            settings.onTileDone(of, tile);
    };
    Renderer renderer(scene, integrator, shader, sampler, filter, passSettings, film.pixelBounds());
    Film pass(film.fullWidth(), film.fullHeight(), film.pixelBounds(), film.layers());
    pass.keepSums(), film.keepSums();
    NoiseEstimate estimate;
    std::optional<double> noise;
    PassTimes times;
    int largest = passSettings.samplesPerPixel;
    const auto statsSoFar = [&] {
        RenderStats stats = renderer.stats();
        stats.noise = noise;
        return stats;
    };
    for (int samples = passSettings.samplesPerPixel;;) {
        const Clock::time_point start = Clock::now();
        pass.clear();
        if (!renderer.render(pass))
            break;
        ++passes;
        film.add(pass);
        times.add(samples, -secondsUntil(start));
        if (goal.noise) {
            estimate.add(pass.image());
            noise = estimate.level();
            if (film.has(Aov::Variance))
                film.setPlane(Aov::Variance, estimate.variances());
        }
        const RenderStats stats = statsSoFar();
        if (const auto later = done(film, stats))
            deadline = later;
        if ((noise && *noise <= *goal.noise) || isToldToStop())
            break;
        if (!goal.noise)
            samples = int(std::min<uint64_t>(kGrowth * uint64_t(largest), uint64_t(most)));
        if (deadline) {
            const int fits = samplesThatFit(samples, times, *deadline);
            if (fits < (goal.noise ? samples : 1)) // passes that tell the noise are all of one size
                break;
            samples = fits;
        }
        if (stats.samplesPerPixel + uint64_t(samples) > PixelAccumulator::kMaxSamples)
            break;
        largest = std::max(largest, samples);
        renderer.restart(hashOf(settings.seed, passes), samples);
    }
    return statsSoFar();
}

RenderStats renderDoubling(const Scene& scene, const Integrator& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           Film& film, const PassDone& done) {
    Renderer renderer(scene, integrator, shader, sampler, filter, settings, film.pixelBounds());
    film.keepSums();
    const uint32_t total = uint32_t(settings.samplesPerPixel);
    for (SampleSlice slice{0, 1}; slice.first < total; slice = {slice.end, std::min(2 * slice.end, total)}) {
        renderer.continueWith(slice);
        renderer.render(film);
        done(film, renderer.stats());
    }
    return renderer.stats();
}

} // namespace strobe
