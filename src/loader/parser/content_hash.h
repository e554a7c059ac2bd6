// Hashes of scenes, to tell whether two renders have the same content.
#pragma once

#include "loader/parser/description.h"

namespace strobe {

/// Returns a hash of all texts that the description was read from, and of the sizes and modification times of
/// all files that parameters of textures, materials, lights and shapes name. Scenes are not built for it.
uint64_t contentHash(const SceneDescription& description);

} // namespace strobe
