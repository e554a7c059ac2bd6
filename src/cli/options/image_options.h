// The options that a render and a merge have in common: how pixels become files.
#pragma once

#include "session/options.h"

#include <CLI/CLI.hpp>

namespace strobe {

/// Declares the options, and sets the color config to that of $OCIO, if that is set. `options` outlives the
/// parsing.
void addImageOptions(CLI::App& app, ImageOptions& options);

/// Replaces the name "-" by "-.exr": standard output, as an EXR.
void nameStandardOutput(std::vector<std::filesystem::path>& images);

} // namespace strobe
