// Standard input and output as files.
#pragma once

#include <filesystem>

namespace strobe {

/// Whether a file name means standard input or output: "-", or "-" and an extension that gives the format, as
/// "-.png". ("./-.png" is a file.)
inline bool isStandardStream(const std::filesystem::path& file) {
    return file.stem() == "-" && !file.has_parent_path();
}

} // namespace strobe
