// Reading of whole files.
#pragma once

#include "core/math/api.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace STROBE_API strobe {

/// The contents of a file.
struct FileBytes {
    std::shared_ptr<const char[]> bytes;
    size_t size = 0;
    std::string_view view() const { return {bytes.get(), size}; }
};

/// Returns whether a file that begins with `text` is a pointer of Git LFS, which stands in a clone for a file
/// that was not downloaded.
inline bool isLfsPointer(std::string_view text) { return text.starts_with("version https://git-lfs"); }
/// The end of the message of an error about such a file: `"NAME" is …`.
inline constexpr const char* kLfsPointerMessage =
    "is a pointer of Git LFS, not the file itself: run \"git lfs pull\" in its repository";

/// Called before an allocation, with its size in bytes; throws if the allocation exceeds a limit.
using MemoryCheck = std::function<void(uint64_t bytes)>;

/// Reads a regular file, or a pipe to its end. Files in gzip format are decompressed, whatever their
/// extension. Throws std::runtime_error with a message that does not contain the file name, and passes on the
/// exceptions of `memoryCheck`.
FileBytes readFileBytes(const std::filesystem::path& path, const MemoryCheck& memoryCheck = nullptr);

} // namespace strobe
