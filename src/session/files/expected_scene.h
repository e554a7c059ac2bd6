// Comparison of a render's scene with that of earlier statistics.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace strobe {

/// The hash of a scene, and the names and hashes of its files, as SceneContent has them.
struct SceneHashes {
    uint64_t scene = 0;
    std::vector<std::pair<std::string, uint64_t>> files;
};

/// Throws Error of kind Usage, which names the files that differ, unless this version of strobe wrote the
/// statistics `stats` (see OutputOptions::stats), of this scene; and if the file cannot be read or is not of
/// that format.
void checkExpectedScene(const std::filesystem::path& stats, const SceneHashes& hashes);

} // namespace strobe
