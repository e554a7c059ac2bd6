// Sequences of frames: which, when, into which files, and whether they are there already.
#pragma once

#include "session/options.h"

namespace strobe {

/// Reads "first:last", "first:last:step" or a single frame; nothing when the text is none of them.
std::optional<Sequence> parseFrames(const std::string& text);

/// When the shutter is open for a frame, in scene time.
Shutter shutterOf(const Sequence& sequence, int frame);

/// The file of one frame. A run of # in its name, or %d, %4d, %04d, stands for the number; a name that has
/// neither gets ".0001" before its extension.
std::filesystem::path numbered(const std::filesystem::path& file, int frame);

/// The options of one frame by itself: its files and `frameKey`, which tells it from frames of other commands
/// or of a scene that has changed. `content`: of contentHash.
Options optionsOfFrame(const Options& options, int frame, uint64_t content);

/// True when every file that these options of a frame ask for is there and the pictures have its key.
bool isFinished(const Options& frame);

} // namespace strobe
