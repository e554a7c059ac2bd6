// The "fbm" and "wrinkled" textures.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// pbrt's fbm: a sum of octaves of noise over the position in texture space; about -1 to 1.
Plugin<TexturePtr, const TextureArgs&> fbmTexturePlugin();

/// pbrt's wrinkled: a sum of the magnitudes of octaves of noise.
Plugin<TexturePtr, const TextureArgs&> wrinkledTexturePlugin();

} // namespace strobe
