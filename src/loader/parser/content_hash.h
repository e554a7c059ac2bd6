// Tells whether two scenes are the same, without building them.
#pragma once

#include "loader/parser/description.h"

namespace strobe {

/// A hash of every text that the description was read from, and of the size and the time of last change of
/// every file that parameters of textures, materials, lights and shapes name.
uint64_t contentHash(const SceneDescription& description);

} // namespace strobe
