// Whole files in memory.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace strobe {

/// The contents of a file.
struct FileBytes {
    std::shared_ptr<const char[]> bytes;
    size_t size = 0;
    std::string_view view() const { return {bytes.get(), size}; }
};

/// Reads a regular file; one that gzip has packed (whatever it is called) is unpacked. Throws
/// std::runtime_error that says what is wrong, without the file's name.
FileBytes readFileBytes(const std::filesystem::path& path);

} // namespace strobe
