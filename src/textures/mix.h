// A blend of two textures by a third.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> mixTexturePlugin();

} // namespace strobe
