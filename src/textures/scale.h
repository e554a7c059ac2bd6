// The "scale" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// The product of two inputs.
Plugin<TexturePtr, const TextureArgs&> scaleTexturePlugin();

} // namespace strobe
