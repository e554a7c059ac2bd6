#include "session/render_session.h"

#include "display/display_server.h"

#include <condition_variable>
#include <thread>

namespace strobe {

namespace {

using Seconds = std::chrono::duration<double>;
using namespace std::chrono_literals;

/// Calls a function at intervals, from a thread of its own, until it is destroyed. A running call is awaited.
class PeriodicTask {
  public:
    PeriodicTask(Seconds interval, std::function<void()> task)
        : m_thread([this, interval, task = std::move(task)] {
              std::unique_lock lock(m_mutex);
              while (!m_wake.wait_for(lock, interval, [this] { return m_ends; })) {
                  lock.unlock();
                  task();
                  lock.lock();
              }
          }) {}
    ~PeriodicTask() {
        {
            const std::lock_guard lock(m_mutex);
            m_ends = true;
        }
        m_wake.notify_all();
        m_thread.join();
    }
    PeriodicTask(const PeriodicTask&) = delete;
    PeriodicTask& operator=(const PeriodicTask&) = delete;

  private:
    std::mutex m_mutex;
    std::condition_variable m_wake;
    bool m_ends = false;
    std::thread m_thread; ///< last: it uses the other members
};

/// Sets the function that RenderControl::saveCheckpoint calls, until it is destroyed. `control` may be null.
class SaveFunctionScope {
  public:
    SaveFunctionScope(RenderControl* control, std::function<void()> save) : m_control(control) {
        if (m_control)
            m_control->setSaveFunction(std::move(save));
    }
    ~SaveFunctionScope() {
        if (m_control)
            m_control->setSaveFunction(nullptr);
    }
    SaveFunctionScope(const SaveFunctionScope&) = delete;
    SaveFunctionScope& operator=(const SaveFunctionScope&) = delete;

  private:
    RenderControl* const m_control;
};

/// Returns the name of the image in the viewer.
std::string viewerImageName(const RenderOptions& options) {
    const auto& images = options.output.images;
    return (images.empty() ? options.scenes.front() : images.front()).filename().string();
}

} // namespace

RenderSettings renderSettings(const RenderOptions& options, const BuiltScene& built) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.slice = options.sampleRange;
    if (options.slice)
        settings.regions = tilesOfSlice(tilesOfSlices(built, options.slice->count), options.slice->number);
    settings.seed = options.seed;
    settings.clamp = options.clamp;
    settings.threads = options.threads;
    settings.tileSize = options.tileSize;
    const bool makesPart = std::any_of(options.output.images.begin(), options.output.images.end(), isPart);
    if (makesPart)
        settings.pilotBounds = PixelBounds{0, 0, built.resolution.x, built.resolution.y};
    settings.recordsLayers = makesPart || options.progressive.checkpointInterval > 0;
    return settings;
}

RenderSession::RenderSession(const FrameJob& job, const FrameInputs& inputs, const RenderSettings& settings,
                             Film& film, const WriteOutputs& write)
    : m_job(job), m_built(inputs.built), m_inputs(inputs), m_log(inputs.log),
      m_control(inputs.callbacks.control), m_settings(settings), m_film(film), m_write(write),
      m_toTotalFraction([](double fraction) { return fraction; }), m_checkpointWriter(inputs.log) {
    if (!progressive().reference.empty())
        m_curve.emplace(progressive().reference, film);
    // Slices of a doubling render cannot be left out.
    if (m_control && (!m_curve || progressive().takesPasses()))
        m_settings.stop = [control = m_control] { return control->isStopped(); };
    if (progressive().checkpointInterval > 0)
        resumeFromCheckpoint();
    if (progressive().writeInterval > 0 || progressive().viewer || m_checkpoint)
        connectLiveFilm();
    if (const auto& onProgress = inputs.callbacks.onProgress) {
        onProgress(0);
        m_settings.onProgress = [this, &onProgress](double fraction) {
            onProgress(m_toTotalFraction(fraction));
        };
    }
}

RenderSession::~RenderSession() = default;

void RenderSession::resumeFromCheckpoint() {
    m_film.enableAccumulation();
    m_checkpoint.emplace(m_job, m_built, layoutOf(m_settings));
    m_settings.resume = progressive().resume && m_checkpoint->resume(m_film);
    for (const FilmRecord& record : m_film.layerRecords().all())
        loadLayers(record, m_settings.aovs ? &m_settings.aovs->sums() : nullptr, m_settings.lights);
    if (progressive().resume && !m_settings.resume)
        m_log.info("there is no checkpoint to resume from");
}

void RenderSession::connectLiveFilm() {
    m_live = std::make_shared<LiveFilm>(m_film);
    m_settings.onTileDone = [this](const Film& film, const PixelBounds& tile) { m_live->update(film, tile); };
    if (m_settings.resume)
        m_live->update(m_film, m_film.pixelBounds());
}

RenderStats RenderSession::run() {
    std::optional<DisplayServer> viewer;
    if (progressive().viewer)
        viewer.emplace(*progressive().viewer, viewerImageName(m_job.options), m_live,
                       progressive().timeLimit > 0 ? 100ms : 2000ms,
                       [this](const std::string& text) { m_log.warn("{}", text); });
    std::optional<PeriodicTask> unfinishedImages;
    if (progressive().writeInterval > 0)
        unfinishedImages.emplace(Seconds(progressive().writeInterval), [this] { writeUnfinishedImage(); });
    const RenderStats stats = m_checkpoint ? renderWithCheckpoints() : render();
    if (m_inputs.callbacks.onRendered)
        m_inputs.callbacks.onRendered();
    return stats;
}

RenderStats RenderSession::renderWithCheckpoints() {
    RenderStats stats;
    {
        const auto save = [this] { saveCheckpoint(); };
        const PeriodicTask periodic(Seconds(progressive().checkpointInterval), save);
        const SaveFunctionScope onRequest(m_control, save);
        try {
            stats = render();
        } catch (...) { // a texture file may have become unreadable: keep the pixels finished until then
            save();
            throw;
        }
    }
    if (stats.passes == 0)
        m_checkpoint->save(m_film, m_checkpointWriter);
    return stats;
}

RenderStats RenderSession::render() {
    if (progressive().takesPasses())
        return renderInPasses();
    if (m_curve && m_built.integrator->dependence() != SampleDependence::Render)
        return renderInDoublingSlices();
    const RenderStats stats = strobe::render(*m_built.scene, *m_built.integrator, *m_built.shader,
                                             *m_built.sampler.sampler, *m_built.filter, m_settings, m_film);
    if (m_curve && stats.passes > 0)
        addToErrorCurve(m_film, stats);
    return stats;
}

RenderStats RenderSession::renderInPasses() {
    PassGoal goal;
    if (progressive().timeLimit > 0)
        goal.deadline = deadline();
    if (progressive().noiseTarget > 0)
        goal.noise = progressive().noiseTarget;
    const int maxSamples = m_job.options.build.samplesPerPixel > 0 ? m_settings.samplesPerPixel
                                                                   : int(PixelAccumulator::kMaxSamples);
    m_toTotalFraction = [this](double) { return std::max(m_reached, timeLimitFraction()); };
    return renderPasses(
        *m_built.scene, *m_built.integrator, *m_built.shader, *m_built.sampler.sampler, *m_built.filter,
        m_settings, goal, maxSamples, m_film,
        [this](const Film& film, const RenderStats& stats) { return onPassDone(film, stats); });
}

RenderStats RenderSession::renderInDoublingSlices() {
    m_toTotalFraction = [this](double fraction) {
        return m_reached + fraction * std::max(1.0 / m_settings.samplesPerPixel, m_reached);
    };
    return renderDoubling(
        *m_built.scene, *m_built.integrator, *m_built.shader, *m_built.sampler.sampler, *m_built.filter,
        m_settings, m_film,
        [this](const Film& film, const RenderStats& stats) { return onPassDone(film, stats); });
}

/// Returns the new deadline of the passes, if it changes.
std::optional<PassGoal::Clock::time_point> RenderSession::onPassDone(const Film& film,
                                                                     const RenderStats& stats) {
    if (m_live)
        m_live->update(film, film.pixelBounds());
    {
        const std::lock_guard lock(m_mutex);
        m_passStats = stats;
    }
    if (m_curve)
        addToErrorCurve(film, stats);
    if (stats.noise)
        m_log.debug("pass {}: noise {:.4g}", stats.passes, *stats.noise);
    m_reached = goalFraction(stats);
    if (progressive().timeLimit > 0 && stats.passes == 1)
        return reserveWritingTime(film, stats);
    return {};
}

/// Writes the image after the first pass, to measure how long writing takes, and returns the deadline of the
/// passes that leaves this time. (The image also remains if the program crashes later.)
PassGoal::Clock::time_point RenderSession::reserveWritingTime(const Film& film, const RenderStats& stats) {
    const Clock::time_point begin = Clock::now();
    if (begin > deadline())
        m_log.warn("--time-limit {}: a single pass took {:.1f} s", progressive().timeLimit,
                   Seconds(begin - m_inputs.start).count());
    tryToWrite("--time-limit", [&] { m_write(film, stats, false); });
    // The last write may have to wait for a periodic one.
    const int writes = progressive().writeInterval > 0 ? 2 : 1;
    return deadline() - writes * (Clock::now() - begin);
}

void RenderSession::addToErrorCurve(const Film& film, const RenderStats& stats) {
    const ErrorCurve::Point& p = m_curve->add(film, stats);
    m_log.info("{:8.2f} s, {} samples per pixel: RMSE {:.5f}, relative {:.5f}", p.seconds, p.samplesPerPixel,
               p.rmse, p.relative);
    if (!progressive().errorCurve.empty())
        m_curve->write(progressive().errorCurve);
}

void RenderSession::writeUnfinishedImage() {
    RenderStats stats;
    {
        const std::lock_guard lock(m_mutex);
        stats = m_passStats;
    }
    tryToWrite("--write-interval", [&] { m_write(m_live->film(), stats, false); });
}

void RenderSession::saveCheckpoint() {
    tryToWrite("--checkpoint", [this] { m_checkpoint->save(m_live->film(), m_checkpointWriter); });
}

/// Warns of the first failure and ignores the others: later writes may succeed.
void RenderSession::tryToWrite(const char* option, const std::function<void()>& write) {
    try {
        write();
    } catch (const std::exception& e) { // Error, or std::bad_alloc
        if (!m_hasWarnedOfWriting.exchange(true))
            m_log.warn("{}: {}", option, e.what());
    }
}

PassGoal::Clock::time_point RenderSession::deadline() const {
    return m_inputs.start + std::chrono::duration_cast<Clock::duration>(Seconds(progressive().timeLimit));
}

/// Returns the fraction of the time limit that has passed; 0 without a limit.
double RenderSession::timeLimitFraction() const {
    const double limit = progressive().timeLimit;
    return limit > 0 ? std::min(Seconds(Clock::now() - m_inputs.start).count() / limit, 1.0) : 0;
}

/// Returns the fraction of the way to the time limit, noise target or number of samples. Noise is inversely
/// proportional to the square root of the number of samples.
double RenderSession::goalFraction(const RenderStats& stats) const {
    double reached = timeLimitFraction();
    if (progressive().noiseTarget > 0)
        reached = std::max(reached, stats.noise ? std::pow(progressive().noiseTarget / *stats.noise, 2) : 0);
    else if (progressive().timeLimit == 0)
        reached = double(stats.samplesPerPixel) / m_settings.samplesPerPixel;
    return std::clamp(reached, m_reached, 1.0);
}

} // namespace strobe
