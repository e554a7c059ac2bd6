// The product of two textures.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> scaleTexturePlugin();

} // namespace strobe
