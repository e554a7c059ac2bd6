// For readers that want a file.
#pragma once

#include "core/util/resource_policy.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

/// An empty folder of this process.
inline const std::filesystem::path& fuzzFolder() {
    static const std::filesystem::path path = [] {
        std::string folder = (std::filesystem::temp_directory_path() / "strobe-fuzz-XXXXXX").string();
        if (!mkdtemp(folder.data()))
            throw std::runtime_error("no folder for temporary files");
        return folder;
    }();
    return path;
}

/// A file with these bytes, alone in that folder; the next call writes over it.
inline const std::filesystem::path& fuzzFile(const uint8_t* data, size_t size, const char* extension) {
    static const std::filesystem::path path = fuzzFolder() / (std::string("input") + extension);
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), std::streamsize(size));
    return path;
}

/// Lets nothing be read but that, and little memory be taken.
inline std::shared_ptr<const strobe::ResourcePolicy> fuzzGuard() {
    static const auto all = std::make_shared<const strobe::ResourcePolicy>(
        strobe::ResourcePolicy::Settings{{fuzzFolder()}, uint64_t(2) << 30});
    return all;
}
