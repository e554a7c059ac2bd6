// The options that decide how long is rendered, what shows it on the way, and which part of it is done here.
#pragma once

#include "session/options.h"

#include <CLI/CLI.hpp>

namespace strobe {

/// Texts as given, until they are read.
struct ProgressiveTexts {
    std::optional<std::string> display, samples;
    std::vector<int> bounds;
};

/// Both refer to `options` and `texts` until the command line is parsed.
void addProgressiveOptions(CLI::App& app, Options& options, ProgressiveTexts& texts);

/// When all other options are read. Throws CLI::ValidationError for texts that are wrong, and for options
/// that do not go together.
void readProgressiveOptions(const ProgressiveTexts& texts, Options& options);

} // namespace strobe
