// Whole files in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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

/// Told how many bytes of memory are about to be taken; throws if that is too much.
using MemoryCheck = std::function<void(uint64_t bytes)>;

/// Reads a regular file; one that gzip has packed (whatever it is called) is unpacked. Throws
/// std::runtime_error that says what is wrong, without the file's name, and what `memoryCheck` throws.
FileBytes readFileBytes(const std::filesystem::path& path, const MemoryCheck& memoryCheck = nullptr);

} // namespace strobe
