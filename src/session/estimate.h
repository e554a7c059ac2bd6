// Estimates before rendering: the time, and files of all samples.
#pragma once

#include "core/render/render_settings.h"
#include "session/frame.h"

namespace strobe {

/// Warns if the render takes days at a usual rate. Throws Error of kind Usage if --samples needs more memory
/// than the machine has.
void checkWork(const FrameJob& job, const BuiltScene& built, const RenderSettings& settings, const Log& log);

/// The estimated time and memory of a render.
struct Estimate {
    double threadSeconds = 0;          ///< of rendering a frame: seconds times threads
    uint64_t memory = 0;               ///< bytes
    std::vector<int> frames, finished; ///< the frames of a sequence, and those of them that are finished
};

/// Logs what would be rendered, and an estimate from a small render of the middle of the picture; writes it
/// to the statistics of the job, if it has any. `frames` and `finished`: see Estimate.
void reportDryRun(const FrameJob& job, const FrameInputs& inputs, std::vector<int> frames,
                  std::vector<int> finished);

} // namespace strobe
