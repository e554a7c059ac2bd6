// A checkerboard of two textures, box-filtered over the footprint in closed form.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> checkerboardTexturePlugin();

} // namespace strobe
