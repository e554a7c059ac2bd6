// The options that say what scenes may read and take, and what of their numbers.
#pragma once

#include "session/options.h"

#include <CLI/CLI.hpp>

namespace strobe {

void addGuardOptions(CLI::App& app, Options& options);

/// Lets the system, too, refuse what is beyond --max-memory: what nobody asked the guard for is then an error
/// of memory. To be called before there are threads.
void limitMemory(const ResourcePolicy::Settings& guard);

} // namespace strobe
