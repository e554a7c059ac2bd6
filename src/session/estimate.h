// Estimates before rendering: the time, and files of all samples.
#pragma once

#include "core/render/render_settings.h"
#include "session/frame.h"

namespace strobe {

/// Warns if the render takes days at a usual rate. Throws Error of kind Usage if --samples needs more memory
/// than the machine has.
void checkWork(const FrameJob& job, const BuiltScene& built, const RenderSettings& settings, const Log& log);

/// Logs what would be rendered, and an estimate of the time from a small render of the middle of the picture.
/// `frames`: the number of frames of a sequence.
void reportDryRun(const FrameJob& job, const FrameInputs& inputs, size_t frames);

} // namespace strobe
