// Reports of a render: EXR metadata, JSON statistics, and messages.
#pragma once

#include "core/render/render.h"
#include "session/estimate.h"
#include "session/frame.h"

namespace strobe {

/// Returns the attributes of the frame's images. `isFinished`: of an unfinished image they have
/// strobe:unfinished, and no frame key.
Metadata renderMetadata(const BuiltScene& built, const FrameJob& job, const RenderStats& stats,
                        const StepSeconds& seconds, bool isFinished);
/// Writes JSON. Throws Error of kind Output.
void writeStats(const std::filesystem::path& file, const BuiltScene& built, const FrameJob& job,
                const RenderStats& stats, const StepSeconds& seconds);
/// Writes JSON of a render that has not begun. Throws Error of kind Output.
void writeEstimate(const std::filesystem::path& file, const FrameJob& job, const FrameInputs& inputs,
                   const Estimate& estimate);
/// Returns one line: size, samples, seconds, rays, shades.
std::string summary(const BuiltScene& built, const RenderStats& stats, const StepSeconds& seconds);
/// Logs the number of clamped samples, and of invalid samples with the options that render the first of them.
void reportInvalidSamples(const RenderStats& stats, const FrameJob& job, const BuiltScene& built,
                          const Log& log);
/// Warns if the memory for textures is so small that the same texels are read again and again.
void reportTextures(const BuiltScene& built, const Log& log);

} // namespace strobe
