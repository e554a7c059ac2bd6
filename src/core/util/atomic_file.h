// Atomic writing of output files.
#pragma once

#include <filesystem>
#include <string_view>

namespace strobe {

/// Writes `bytes` to a temporary file in the directory of `path`, flushes it to disk and renames it to
/// `path`. At any time, `path` is either the old file or the complete new file. If `path` is a symbolic link,
/// its target is replaced. Throws Error of kind Output, also if `path` exists and is not a regular file; then
/// `path` is unchanged, and no temporary file remains.
void writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

} // namespace strobe
