// Comparison of a render's scene with that of earlier statistics.
#pragma once

#include "loader/parser/content_hash.h"

#include <filesystem>

namespace strobe {

/// Throws Error of kind Usage, which names the files that differ, unless this version of strobe wrote the
/// statistics `stats` (see OutputOptions::stats), of a scene with this content; and if the file cannot be
/// read or is not of that format.
void checkExpectedScene(const std::filesystem::path& stats, const SceneContent& content);

} // namespace strobe
