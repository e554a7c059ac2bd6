// Files for fuzz targets whose readers need one.
#pragma once

#include "core/util/resource_policy.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

/// Returns the folder of this process, which is empty at first.
inline const std::filesystem::path& fuzzFolder() {
    static const std::filesystem::path path = [] {
        std::string folder = (std::filesystem::temp_directory_path() / "strobe-fuzz-XXXXXX").string();
        if (!mkdtemp(folder.data()))
            throw std::runtime_error("no folder for temporary files");
        return folder;
    }();
    return path;
}

/// Writes the bytes to the only file of that folder, and returns its path. The next call overwrites it.
inline const std::filesystem::path& fuzzFile(const uint8_t* data, size_t size, const char* extension) {
    static const std::filesystem::path path = fuzzFolder() / (std::string("input") + extension);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), std::streamsize(size));
    return path;
}

/// Returns a policy that allows reading that folder only, and 2 GiB of memory.
inline std::shared_ptr<const strobe::ResourcePolicy> fuzzGuard() {
    static const auto all = std::make_shared<const strobe::ResourcePolicy>(
        strobe::ResourcePolicy::Settings{{fuzzFolder()}, uint64_t(2) << 30});
    return all;
}
