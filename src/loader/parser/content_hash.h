// Hashes of scenes, to tell whether two renders have the same content.
#pragma once

#include "loader/parser/description.h"

#include <utility>

namespace strobe {

/// What a scene consists of, as hashes.
struct SceneContent {
    uint64_t hash = 0; ///< of all
    /// Names and hashes of the texts and files, sorted by name. At most kMaxFiles; more are in `hash` only.
    std::vector<std::pair<std::string, uint64_t>> files;
    static constexpr size_t kMaxFiles = 4096;
};

/// Returns a hash of bytes.
uint64_t textHash(std::string_view text);

/// Returns hashes of all texts that the description was read from, of the values of $NAME, and of all files
/// that parameters of textures, materials, lights and shapes name: of their content, or of their size and
/// modification time beyond 64 MiB; and `others`, names and hashes of other content. Scenes are not built for
/// it.
SceneContent contentOf(const SceneDescription& description,
                       const std::vector<std::pair<std::string, uint64_t>>& others = {});

} // namespace strobe
