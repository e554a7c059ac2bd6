// The options that limit what scenes read and take, and the options about invalid and bright samples.
#pragma once

#include "session/options.h"

#include <CLI/CLI.hpp>

namespace strobe {

/// Declares the options. `options` outlives the parsing.
void addResourceOptions(CLI::App& app, RenderOptions& options);

/// Makes the system enforce --max-memory: allocations that ResourcePolicy does not check then throw
/// std::bad_alloc. To be called before there are threads.
void limitMemory(const ResourcePolicy::Settings& resources);

} // namespace strobe
