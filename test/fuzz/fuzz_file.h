// For readers that want a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

/// A file with these bytes; the next call writes over it.
inline const std::filesystem::path& fuzzFile(const uint8_t* data, size_t size, const char* extension) {
    static const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("strobe-fuzz-" + std::to_string(getpid()) + extension);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), std::streamsize(size));
    return path;
}
