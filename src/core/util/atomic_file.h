// Atomic writing of output files.
#pragma once

#include "core/math/api.h"

#include <filesystem>
#include <string_view>

namespace STROBE_API strobe {

/// Writes `bytes` to a temporary file in the directory of `path`, flushes it to disk and renames it to
/// `path`. At any time, `path` is either the old file or the complete new file. If `path` is a symbolic link,
/// its target is written, also if it does not exist yet. Throws Error of kind Output, also if `path` exists
/// and is not a regular file; then `path` is unchanged, and no temporary file remains. If
/// isStandardStream(path), writes to standard output.
void writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// Throws the error that writeFileAtomically would throw now, apart from that of a full disk. Creates and
/// removes a temporary file; does not change `path`.
void checkWriteAtomically(const std::filesystem::path& path);

} // namespace strobe
