// The "windy" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// pbrt's windy: waves, as displacement of water. A slow fbm modulates the height of a faster one.
Plugin<TexturePtr, const TextureArgs&> windyTexturePlugin();

} // namespace strobe
