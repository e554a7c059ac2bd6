// strobe merge PART… -o OUT…: parts of a render become the whole.
#pragma once

#include "session/output_options.h"
#include "session/part_file.h"

#include <spdlog/logger.h>

namespace strobe {

struct MergeOptions {
    std::vector<std::filesystem::path> parts, outputs;
    PictureOptions picture;
    bool quiet = false, strict = false;
};

/// The arguments after "merge"; an exit code when there is nothing more to do.
std::optional<int> parseMerge(int argc, char** argv, MergeOptions& options);

/// Reads the parts, puts them together and writes the outputs: pictures, or (.part) a part again. Warns of
/// samples that are still missing, and of pictures that are smaller than the frame. Returns the exit code;
/// throws Error.
int merge(const MergeOptions& options, spdlog::logger& log);

} // namespace strobe
