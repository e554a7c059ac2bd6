// Output files that are either whole or not there.
#pragma once

#include <filesystem>
#include <string_view>

namespace strobe {

/// Writes `bytes` to a temporary file in the directory of `path`, flushes it to the disk and renames it:
/// under the final name there is the old file or the whole new one, never a part. A symbolic link is
/// followed. Throws Error of kind Output, and then leaves neither a temporary file nor a change; also when
/// `path` exists and is no regular file.
void writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

} // namespace strobe
