// Rendering of one frame into a film: plain, in passes or with checkpoints, with a viewer and unfinished
// images.
#pragma once

#include "core/render/passes.h"
#include "session/checkpoint.h"
#include "session/files/csv_tables.h"

#include <atomic>

namespace strobe {

/// Writes the outputs from a film. `isFinished`: no samples will follow.
using WriteOutputs = std::function<void(const Film&, const RenderStats&, bool isFinished)>;

/// Returns the settings of the options for a frame of the scene. With a .part as output, a pilot of the
/// integrator looks at the whole frame, so that all parts of the frame decide alike.
RenderSettings renderSettings(const RenderOptions& options, const BuiltScene& built);

/// Renders one frame as its options say. All references outlive the session.
class RenderSession {
  public:
    /// `settings` has the AOVs and callbacks of the caller. `write` is called for unfinished images only.
    /// Reads the reference and the checkpoint into the film. Throws Error.
    RenderSession(const FrameJob& job, const FrameInputs& inputs, const RenderSettings& settings, Film& film,
                  const WriteOutputs& write);
    ~RenderSession();
    RenderSession(const RenderSession&) = delete;
    RenderSession& operator=(const RenderSession&) = delete;

    /// Renders. RenderStats::passes is 0 if RenderControl::stop ended the render; the checkpoint, if the
    /// options have one, is then saved. Throws Error.
    RenderStats run();

  private:
    using Clock = PassGoal::Clock;

    void resumeFromCheckpoint();
    void connectLiveFilm();
    RenderStats renderWithCheckpoints();
    RenderStats render();
    RenderStats renderInPasses();
    RenderStats renderInDoublingSlices();
    std::optional<Clock::time_point> onPassDone(const Film& film, const RenderStats& stats);
    Clock::time_point reserveWritingTime(const Film& film, const RenderStats& stats);
    void addToErrorCurve(const Film& film, const RenderStats& stats);
    void writeUnfinishedImage();
    void saveCheckpoint();
    void tryToWrite(const char* option, const std::function<void()>& write);
    Clock::time_point deadline() const;
    double timeLimitFraction() const;
    double goalFraction(const RenderStats& stats) const;
    const ProgressiveOptions& progressive() const { return m_job.options.progressive; }

    const FrameJob& m_job;
    const BuiltScene& m_built;
    const FrameInputs& m_inputs;
    const Log& m_log;
    RenderControl* const m_control; ///< null: none
    RenderSettings m_settings;
    Film& m_film;
    const WriteOutputs& m_write;
    std::function<double(double)> m_toTotalFraction; ///< from the fraction of the current pass or slice
    double m_reached = 0;                            ///< fraction of the goal reached by the passes so far
    std::optional<ErrorCurve> m_curve;
    std::shared_ptr<LiveFilm> m_live; ///< null: nothing reads the unfinished image
    std::mutex m_mutex;
    RenderStats m_passStats; ///< of the passes so far; guarded by m_mutex
    std::optional<Checkpoint> m_checkpoint;
    FallbackWriter m_checkpointWriter;
    std::atomic<bool> m_hasWarnedOfWriting{false};
};

} // namespace strobe
