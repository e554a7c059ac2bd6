#include "session/render_session.h"

#include "display/display_server.h"
#include "session/checkpoint.h"
#include "session/error_curve.h"
#include "session/periodic_writer.h"

#include <fmt/format.h>

namespace strobe {

namespace {

using Clock = PassGoal::Clock;
using Seconds = std::chrono::duration<double>;
using namespace std::chrono_literals;

std::string imageName(const Options& options) {
    return (options.outputs.empty() ? options.scenes.front() : options.outputs.front()).filename().string();
}

/// A picture on its way, and those who hear of it.
class Picture {
  public:
    Picture(const BuiltScene& built, const Options& options, const RenderSettings& settings,
            Clock::time_point start, StopSignals* signals, Film& film, const WriteOutputs& write,
            spdlog::logger& log)
        : m_built(built), m_options(options), m_settings(settings), m_start(start), m_film(film),
          m_write(write), m_log(log), m_progress(options.quiet) {
        if (!options.reference.empty())
            m_curve.emplace(options.reference, film);
        if (signals)
            m_settings.stop = [signals] { return signals->stops(); };
        if (options.checkpoint > 0)
            goOn(signals);
        if (options.partial > 0 || options.display || m_checkpoint)
            m_live = std::make_shared<LiveFilm>(film);
        if (m_live)
            m_settings.onTileDone = [this](const Film& of, const PixelBounds& tile) {
                m_live->update(of, tile);
            };
        if (m_live && m_settings.resume)
            m_live->update(film, film.pixelBounds());
        m_settings.onProgress = [this](double part) { m_progress.update(m_fraction(part)); };
    }

    RenderStats make() {
        std::optional<DisplayServer> display;
        if (m_options.display)
            display.emplace(*m_options.display, imageName(m_options), m_live,
                            m_options.timeLimit > 0 ? 100ms : 2000ms,
                            [this](const std::string& text) { m_log.warn("{}", text); });
        std::optional<PeriodicWriter> partial;
        if (m_options.partial > 0)
            partial.emplace(Seconds(m_options.partial), [this] { writePartial(); });
        const RenderStats stats = renderSafely();
        m_progress.finish();
        return stats;
    }

  private:
    /// Takes up what there is of the picture.
    void goOn(StopSignals* signals) {
        m_film.enableAccumulation();
        m_checkpoint.emplace(m_options, m_built);
        m_settings.resume = m_options.resume && m_checkpoint->resume(m_film);
        if (m_options.resume && !m_settings.resume)
            m_log.info("there is nothing to resume from");
        m_signals = signals;
    }

    /// With checkpoints, if that is wanted.
    RenderStats renderSafely() {
        if (!m_checkpoint)
            return render();
        RenderStats stats;
        {
            const auto save = [this] {
                attempt("--checkpoint", [this] { m_checkpoint->save(m_live->film(), m_rescue); });
            };
            const PeriodicWriter saver(Seconds(m_options.checkpoint), save);
            const OnSave onSave(*m_signals, save);
            try {
                stats = render();
            } catch (...) { // a texture may have vanished: what was rendered until then is not lost
                save();
                throw;
            }
        }
        if (stats.passes == 0)
            m_checkpoint->save(m_film, m_rescue);
        return stats;
    }

    /// What SIGHUP does, for a while.
    class OnSave {
      public:
        OnSave(StopSignals& signals, std::function<void()> save) : m_signals(signals) {
            m_signals.onSave(std::move(save));
        }
        ~OnSave() { m_signals.onSave(nullptr); }
        OnSave(const OnSave&) = delete;
        OnSave& operator=(const OnSave&) = delete;

      private:
        StopSignals& m_signals;
    };

    RenderStats render() {
        const BuiltScene& b = m_built;
        const Sampler& sampler = *b.sampler.sampler;
        const PassDone done = [this](const Film& film, const RenderStats& stats) {
            return passDone(film, stats);
        };
        if (m_options.takesPasses()) {
            PassGoal goal;
            if (m_options.timeLimit > 0)
                goal.deadline = timeLimit();
            if (m_options.noiseTarget > 0)
                goal.noise = m_options.noiseTarget;
            const int most = m_options.build.samplesPerPixel > 0 ? m_settings.samplesPerPixel
                                                                 : int(PixelAccumulator::kMaxSamples);
            m_fraction = [this](double) { return std::max(m_reached, timeSpent()); };
            return renderPasses(*b.scene, *b.integrator, *b.shader, sampler, *b.filter, m_settings, goal,
                                most, m_film, done);
        }
        if (m_curve) {
            m_fraction = [this](double part) {
                return m_reached + part * std::max(1.0 / m_settings.samplesPerPixel, m_reached);
            };
            return renderDoubling(*b.scene, *b.integrator, *b.shader, sampler, *b.filter, m_settings, m_film,
                                  done);
        }
        return strobe::render(*b.scene, *b.integrator, *b.shader, sampler, *b.filter, m_settings, m_film);
    }

    Clock::time_point timeLimit() const {
        return m_start + std::chrono::duration_cast<Clock::duration>(Seconds(m_options.timeLimit));
    }

    std::optional<Clock::time_point> passDone(const Film& film, const RenderStats& stats) {
        if (m_live)
            m_live->update(film, film.pixelBounds());
        {
            const std::lock_guard lock(m_mutex);
            m_stats = stats;
        }
        if (m_curve)
            addToCurve(film, stats);
        if (stats.noise)
            m_log.debug("pass {}: noise {:.4g}", stats.passes, *stats.noise);
        m_reached = reachedWith(stats);
        if (m_options.timeLimit > 0 && stats.passes == 1)
            return reserveWriting(film, stats);
        return {};
    }

    /// Writes the picture, which costs time, to know how much of it to keep for the end. (And an early
    /// picture is one that an accident leaves behind.)
    Clock::time_point reserveWriting(const Film& film, const RenderStats& stats) {
        const Clock::time_point begin = Clock::now();
        if (begin > timeLimit())
            m_log.warn("--time-limit {}: a single pass took {:.1f} s", m_options.timeLimit,
                       Seconds(begin - m_start).count());
        attempt("--time-limit", [&] { m_write(film, stats, false); });
        const int writings = m_options.partial > 0 ? 2 : 1; // the end may have to wait for one under way
        return timeLimit() - writings * (Clock::now() - begin);
    }

    void addToCurve(const Film& film, const RenderStats& stats) {
        const ErrorCurve::Point& p = m_curve->add(film, stats);
        m_log.info("{:8.2f} s, {} samples per pixel: RMSE {:.5f}, relative {:.5f}", p.seconds,
                   p.samplesPerPixel, p.rmse, p.relative);
        if (!m_options.curveFile.empty())
            m_curve->write(m_options.curveFile);
    }

    /// Of the limit, if there is one.
    double timeSpent() const {
        return m_options.timeLimit > 0
                   ? std::min(Seconds(Clock::now() - m_start).count() / m_options.timeLimit, 1.0)
                   : 0;
    }

    /// Of the way to the goal; errors fall with the root of the samples.
    double reachedWith(const RenderStats& stats) const {
        double reached = timeSpent();
        if (m_options.noiseTarget > 0)
            reached = std::max(reached, stats.noise ? std::pow(m_options.noiseTarget / *stats.noise, 2) : 0);
        else if (m_options.timeLimit == 0)
            reached = double(stats.samplesPerPixel) / m_settings.samplesPerPixel;
        return std::clamp(reached, m_reached, 1.0);
    }

    void writePartial() {
        RenderStats stats;
        {
            const std::lock_guard lock(m_mutex);
            stats = m_stats;
        }
        attempt("--partial", [&] { m_write(m_live->film(), stats, false); });
    }

    /// Something that may fail, and be tried again later: the disk may have room when it matters.
    void attempt(const char* option, const std::function<void()>& write) {
        try {
            write();
        } catch (const std::exception& e) { // memory may be short, too
            if (!m_warnedOfWriting.exchange(true))
                m_log.warn("{}: {}", option, e.what());
        }
    }

    const BuiltScene& m_built;
    const Options& m_options;
    RenderSettings m_settings;
    const Clock::time_point m_start;
    Film& m_film;
    const WriteOutputs& m_write;
    spdlog::logger& m_log;
    Progress m_progress;
    std::function<double(double)> m_fraction = [](double part) { return part; };
    double m_reached = 0;
    std::optional<ErrorCurve> m_curve;
    std::shared_ptr<LiveFilm> m_live;
    std::mutex m_mutex;
    RenderStats m_stats; ///< of the passes so far; under m_mutex
    std::optional<Checkpoint> m_checkpoint;
    FallbackWriter m_rescue{m_log}; ///< of checkpoints
    StopSignals* m_signals = nullptr;
    std::atomic<bool> m_warnedOfWriting{false};
};

} // namespace

RenderStats renderPicture(const BuiltScene& built, const Options& options, RenderSettings settings,
                          PassGoal::Clock::time_point start, StopSignals* signals, Film& film,
                          const WriteOutputs& write, spdlog::logger& log) {
    RenderStats stats = Picture(built, options, settings, start, signals, film, write, log).make();
    if (stats.noise)
        log.info("noise {:.4g} after {} passes{}", *stats.noise, stats.passes,
                 *stats.noise <= options.noiseTarget ? "" : ": the target is not met");
    return stats;
}

} // namespace strobe
