// From a built scene to a finished film: in one go or in passes, watched or not.
#pragma once

#include "cli/progress.h"
#include "core/render/passes.h"
#include "session/options.h"
#include "session/stop_signals.h"

#include <spdlog/logger.h>

namespace strobe {

/// Writes outputs; `finished`: the picture is.
using WriteOutputs = std::function<void(const Film&, const RenderStats&, bool finished)>;

/// Renders what the options ask for into the film; all but the last writing of the outputs. `start`: of the
/// program, for --time-limit. `signals`: there with --checkpoint. No passes in the result: they ended the
/// render before its time, and a checkpoint is saved. Throws Error.
RenderStats renderPicture(const BuiltScene& built, const Options& options, RenderSettings settings,
                          PassGoal::Clock::time_point start, StopSignals* signals, Film& film,
                          const WriteOutputs& write, spdlog::logger& log);

} // namespace strobe
