// One frame to render: its options, its files, and its identity.
#pragma once

#include "core/math/interleaved_tiles.h"
#include "loader/parser/content_hash.h"
#include "session/log.h"
#include "session/options.h"
#include "session/session.h"

namespace strobe {

/// The options of one frame, with the names of its own files.
struct FrameJob {
    RenderOptions options;
    SceneContent content;
    std::optional<int> number; ///< in the sequence; none: a single image
    std::string key;           ///< of a sequence's frame: hash of the scene, the number and the settings
};

/// Returns the tiles of `count` slices of the frame. Throws Error of kind Usage if there are more slices than
/// pixels.
InterleavedTiles tilesOfSlices(const BuiltScene& built, uint32_t count);

/// Returns the interval, in scene time, during which the shutter is open for a frame.
Shutter shutterOf(const SequenceOptions& sequence, int frame);

/// Returns the name of a frame's file: a run of # in the file name, or %d, %4d or %04d, is replaced by the
/// number; a name without these gets the number before its extension, as ".0001".
std::filesystem::path numberedFile(const std::filesystem::path& file, int frame);

/// Returns the job of one frame of `options.sequence`.
FrameJob frameJob(const RenderOptions& options, int frame, const SceneContent& content);

/// Whether all files of the frame exist, and all its images have its key as the attribute strobe:frameKey.
/// Parts do not count as finished.
bool isFinished(const FrameJob& job);

/// Wall-clock seconds of the steps before rendering.
struct StepSeconds {
    double parse = 0, build = 0;
};

/// What a frame is rendered from, and how it is reported.
struct FrameInputs {
    const BuiltScene& built;
    const ResourcePolicy& policy; ///< of the scene
    StepSeconds seconds;
    std::chrono::steady_clock::time_point start; ///< from which the time limit counts
    const RenderCallbacks& callbacks;
    const Log& log;
};

/// Renders a frame and writes its outputs.
Outcome renderFrame(const FrameJob& job, const FrameInputs& inputs);

} // namespace strobe
