// A checkerboard of two textures, box-filtered over the footprint in closed form.
#pragma once

#include "core/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> checkerboardTexturePlugin();

} // namespace strobe
