// The "constant" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// A texture with the same value everywhere.
Plugin<TexturePtr, const TextureArgs&> constantTexturePlugin();

} // namespace strobe
