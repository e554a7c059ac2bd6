// The "mix" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// The linear interpolation of two inputs by a third: tex1 (1 - amount) + tex2 amount.
Plugin<TexturePtr, const TextureArgs&> mixTexturePlugin();

} // namespace strobe
