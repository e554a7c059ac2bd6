// The folder of the paper's scenes. Tests that need them are skipped if it does not exist.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace strobe::test {

/// Returns the folder of pbrt-v2's scenes: in $STROBE_SCENES, or beside the repository. It may not exist.
inline std::filesystem::path pbrtFolder() {
    const char* variable = std::getenv("STROBE_SCENES");
    const std::filesystem::path scenes = variable && *variable
                                             ? std::filesystem::path(variable)
                                             : std::filesystem::path(STROBE_SOURCE_DIR) / "../shared/scenes";
    return scenes / "pbrt-v2";
}

} // namespace strobe::test
