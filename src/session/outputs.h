// Where results go, and whether they can go there.
#pragma once

#include "session/options.h"

#include <spdlog/logger.h>

namespace strobe {

/// The options with their picture's place: -o, else the scene's own name (but with --sandbox), else the scene
/// file's stem, in the current folder.
Options withOutput(Options options, const std::string& scenesOwn, spdlog::logger& log);

/// Finds out before the work, not after it, that files cannot be written: throws Error of kind Output, or of
/// kind Usage where two are the same.
void checkOutputs(const std::vector<std::filesystem::path>& files);
/// Of all the files that the options name.
void checkOutputs(const Options& options);
/// Throws Error of kind Output where one of them is a file that the scene, by way of the guard, or
/// --reference reads.
void checkNotRead(const Options& options, const ResourcePolicy& guard);

/// Warns of values that became the largest half float, if there are any.
void warnOfClamped(const std::filesystem::path& output, size_t clamped, spdlog::logger& log);

} // namespace strobe
