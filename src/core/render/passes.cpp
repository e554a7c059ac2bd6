#include "core/render/passes.h"

#include "core/math/hash.h"

#include <map>

namespace strobe {

namespace {

using Clock = PassGoal::Clock;

double secondsUntil(Clock::time_point time) {
    return std::chrono::duration<double>(time - Clock::now()).count();
}

/// Predicts the duration of passes from previous ones.
class PassTimes {
  public:
    void add(int samples, double seconds) { m_seconds[samples] = seconds; }
    /// Returns the predicted seconds of a pass. A pass costs a part that does not depend on the samples
    /// (shades that any number of samples share) and a part per sample. The prediction therefore interpolates
    /// linearly between the neighboring pass sizes, and extrapolates the line through the two largest ones;
    /// there, a sample costs between a quarter and the whole of the mean cost of a sample.
    double predict(int samples) const {
        const auto above = m_seconds.lower_bound(samples);
        if (above == m_seconds.begin() || (above != m_seconds.end() && above->first == samples))
            return above->second;
        const auto slope = [](auto a, auto b) { return (b->second - a->second) / (b->first - a->first); };
        const auto below = std::prev(above);
        if (above != m_seconds.end())
            return below->second + slope(below, above) * (samples - below->first);
        const double mean = below->second / below->first;
        const double perSample =
            below == m_seconds.begin() ? mean : std::clamp(slope(std::prev(below), below), mean / 4, mean);
        return below->second + perSample * (samples - below->first);
    }

  private:
    std::map<int, double> m_seconds; ///< of the latest pass of each size, by samples per pixel
};

/// Chooses the samples per pixel of each pass.
class PassSchedule {
  public:
    /// With a noise target, all passes have settings.samplesPerPixel, but at least `fewest`, otherwise
    /// `fewest` to `maxSamples`.
    PassSchedule(const RenderSettings& settings, bool hasNoiseTarget, int fewest, int maxSamples)
        : m_hasNoiseTarget(hasNoiseTarget),
          m_fewest(hasNoiseTarget ? std::max(settings.samplesPerPixel, fewest)
                                  : std::min(fewest, maxSamples)),
          m_maxSamples(maxSamples), m_samples(m_fewest), m_largest(m_samples) {}

    /// The samples of the current pass.
    int samples() const { return m_samples; }
    void recordTime(double seconds) { m_times.add(m_samples, seconds); }
    /// Chooses the samples of the next pass. Returns false if no further pass ends before the deadline, or
    /// fits into the film after `samplesSoFar`.
    bool advance(std::optional<Clock::time_point> deadline, uint64_t samplesSoFar) {
        int samples = m_samples;
        if (!m_hasNoiseTarget)
            samples = int(std::min<uint64_t>(kGrowth * uint64_t(m_largest), uint64_t(m_maxSamples)));
        if (deadline) {
            samples = samplesThatFit(samples, *deadline);
            if (samples == 0)
                return false;
        }
        if (samplesSoFar + uint64_t(samples) > PixelAccumulator::kMaxSamples)
            return false;
        m_samples = samples;
        m_largest = std::max(m_largest, samples);
        return true;
    }

  private:
    /// The ratio of a pass's samples to those of the largest pass before. Few large passes stratify samples
    /// and share shades better than many small ones, but the duration of a large pass is predicted from small
    /// ones, and a pass that takes too long is discarded.
    static constexpr uint64_t kGrowth = 4;

    /// Returns the most samples, of maxSamples divided by powers of two, of a pass that ends before the
    /// deadline; 0 if they are less than m_fewest.
    int samplesThatFit(int maxSamples, Clock::time_point deadline) const {
        constexpr double kVariation = 1.1; // between passes of the same size
        const double left = secondsUntil(deadline);
        int samples = maxSamples;
        while (samples >= m_fewest && m_times.predict(samples) * kVariation > left)
            samples /= 2;
        return samples >= m_fewest ? samples : 0;
    }

    const bool m_hasNoiseTarget;
    const int m_fewest, m_maxSamples;
    int m_samples;
    int m_largest; ///< samples of the largest pass
    PassTimes m_times;
};

/// The state of renderPasses.
class PassLoop {
  public:
    PassLoop(const Scene& scene, const Integrator& integrator, const Shader& shader, const Sampler& sampler,
             const Filter& filter, const RenderSettings& settings, const PassGoal& goal, int maxSamples,
             Film& film)
        : m_integrator(integrator), m_settings(settings), m_goal(goal), m_deadline(goal.deadline),
          m_schedule(settings, goal.noise.has_value(), integrator.fewestSamplesOfPass(), maxSamples),
          m_film(film), m_passFilm(film.fullWidth(), film.fullHeight(), film.pixelBounds(), film.layers()),
          m_renderer(scene, integrator, shader, sampler, filter, passSettings(), film.pixelBounds()) {
        m_passFilm.enableAccumulation();
        m_film.enableAccumulation();
    }
    PassLoop(const PassLoop&) = delete;
    PassLoop& operator=(const PassLoop&) = delete;

    RenderStats run(const PassDone& done) {
        while (renderPass()) {
            if (isFinishDue())
                finish(done);
            else
                m_integrator.mergeRecords(m_film.records());
            const bool isNoiseReached = m_noise && *m_noise <= *m_goal.noise;
            const uint64_t samples = m_renderer.stats().samplesPerPixel;
            if (isNoiseReached || isStopRequested() || !m_schedule.advance(deadlineOfPass(), samples))
                break;
            m_renderer.restart(hashOf(m_settings.seed, m_passes), m_schedule.samples(), samples);
        }
        if (!m_isFinished)
            finish(done);
        return statsSoFar();
    }

  private:
    /// Returns whether the film is to be finished after this pass even if it is not the last one. With a
    /// noise target, that does not depend on the time, as it decides about the number of passes.
    bool isFinishDue() const {
        constexpr int kInterval = 4; // between two calls of Renderer::finish, relative to the time of a call
        if (m_goal.noise)
            return m_passes >= m_nextFinish;
        return m_passes == 1 || m_film.records().isEmpty() || // there is nothing to finish the film with
               Clock::now() - m_lastFinish >= kInterval * m_finishTime;
    }
    void finish(const PassDone& done) {
        const Clock::time_point start = Clock::now();
        std::vector<float> errors;
        m_renderer.finish(m_film, m_goal.noise ? &errors : nullptr);
        m_lastFinish = Clock::now();
        m_finishTime = m_lastFinish - start;
        m_isFinished = true;
        if (m_goal.noise)
            updateNoise(errors);
        if (const auto deadline = done(m_film, statsSoFar()))
            m_deadline = deadline;
    }
    /// `errors`: those that Renderer::finish estimated. Without them, the passes show the noise.
    void updateNoise(std::span<const float> errors) {
        m_noise = errors.empty() ? m_estimate.level() : noiseLevel(m_film.image(), errors);
        m_nextFinish = errors.empty() ? m_passes + 1 : nextFinish();
        if (m_film.has(Aov::Variance))
            m_film.setPlane(Aov::Variance, m_estimate.variances());
    }
    /// Returns the pass to finish the film after. Noise falls with the root of the number of passes.
    int nextFinish() const {
        const double needed = m_passes * sqr(*m_noise / *m_goal.noise);
        const double next = std::min(2.0 * m_passes, std::max(1.125 * m_passes, 0.9 * needed));
        return std::max(int(next), m_passes + 1);
    }
    /// Returns the deadline for the samples of a pass, which leaves time to finish the film.
    std::optional<Clock::time_point> deadlineOfPass() const {
        if (!m_deadline)
            return {};
        return *m_deadline - m_finishTime;
    }
    bool isStopRequested() const { return m_settings.stop && m_settings.stop(); }

    /// Returns the settings of a single pass. Its callbacks run on render threads; m_passes, m_deadline and
    /// m_finishTime change between passes only.
    RenderSettings passSettings() {
        RenderSettings pass = m_settings;
        pass.samplesPerPixel = m_schedule.samples();
        pass.isPass = true;
        pass.stop = [this] {
            return m_passes > 0 && ((m_deadline && Clock::now() > *deadlineOfPass()) || isStopRequested());
        };
        pass.onTileDone = [this](const Film& film, const PixelBounds& tile) {
            if (m_passes == 0 && m_settings.onTileDone)
                m_settings.onTileDone(film, tile);
        };
        return pass;
    }

    /// Renders a pass and adds it to the film. Returns false if it was interrupted; it is then discarded.
    bool renderPass() {
        const Clock::time_point start = Clock::now();
        m_passFilm.clear();
        std::optional<AovSums> aovs;
        if (m_settings.aovs)
            aovs = m_settings.aovs->sums();
        std::optional<LightFilm> lights;
        if (m_settings.lights)
            lights = *m_settings.lights;
        if (!m_renderer.render(m_passFilm)) {
            if (aovs)
                m_settings.aovs->sums() = std::move(*aovs);
            if (lights)
                *m_settings.lights = std::move(*lights);
            return false;
        }
        ++m_passes;
        m_film.merge(m_passFilm);
        m_isFinished = false;
        // The first pass also has the time of Integrator::begin, which is no part of others.
        const double begin = m_passes == 1 ? m_renderer.stats().beginSeconds : 0;
        m_schedule.recordTime(-secondsUntil(start) - begin);
        if (m_goal.noise)
            m_estimate.add(m_passFilm.image());
        return true;
    }

    RenderStats statsSoFar() const {
        RenderStats stats = m_renderer.stats();
        stats.noise = m_noise;
        return stats;
    }

    const Integrator& m_integrator;
    const RenderSettings& m_settings;
    const PassGoal& m_goal;
    std::optional<Clock::time_point> m_deadline;
    Clock::duration m_finishTime{}; ///< that the last Renderer::finish took
    Clock::time_point m_lastFinish;
    int m_nextFinish = 1;      ///< with a noise target: the pass to finish the film after
    bool m_isFinished = false; ///< m_film
    PassSchedule m_schedule;
    int m_passes = 0;
    Film& m_film;
    Film m_passFilm;
    Renderer m_renderer;
    NoiseEstimate m_estimate;
    std::optional<double> m_noise;
};

} // namespace

RenderStats renderPasses(const Scene& scene, const Integrator& integrator, const Shader& shader,
                         const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                         const PassGoal& goal, int maxSamples, Film& film, const PassDone& done) {
    PassLoop loop(scene, integrator, shader, sampler, filter, settings, goal, maxSamples, film);
    return loop.run(done);
}

RenderStats renderDoubling(const Scene& scene, const Integrator& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           Film& film, const PassDone& done) {
    Renderer renderer(scene, integrator, shader, sampler, filter, settings, film.pixelBounds());
    film.enableAccumulation();
    const uint32_t total = uint32_t(settings.samplesPerPixel);
    for (SampleSlice slice{0, 1}; slice.first < total; slice = {slice.end, std::min(2 * slice.end, total)}) {
        renderer.setSlice(slice);
        renderer.render(film);
        renderer.finish(film);
        done(film, renderer.stats());
    }
    return renderer.stats();
}

} // namespace strobe
