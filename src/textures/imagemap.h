// An image file, filtered over the footprint.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

Plugin<TexturePtr, const TextureArgs&> imagemapTexturePlugin();

} // namespace strobe
