// The options of progressive rendering, of parts and of checkpoints.
#pragma once

#include "session/options.h"

#include <CLI/CLI.hpp>

namespace strobe {

/// Declares the options. `options` outlives the parsing.
void addProgressiveOptions(CLI::App& app, RenderOptions& options);

} // namespace strobe
