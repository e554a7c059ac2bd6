// The options of sequences: --frames, --fps, --shutter, --overwrite.
#pragma once

#include "session/options.h"

#include <CLI/CLI.hpp>

namespace strobe {

/// Declares the options. `sequence` outlives the parsing.
void addSequenceOptions(CLI::App& app, SequenceOptions& sequence);

/// Sets RenderOptions::sequence if --frames was given. Throws CLI::ValidationError if another option of
/// sequences was given without it. To be called after the parsing.
void readSequenceOptions(const CLI::App& app, const SequenceOptions& sequence, RenderOptions& options);

} // namespace strobe
