// The "imagemap" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// An image file, filtered over the footprint by the texture cache. The first row of the image is at v = 1,
/// under the conventions of pbrt-v2 at v = 0. Values are scaled, then inverted (max(1 - value, 0)). 8- and
/// 16-bit files are decoded from sRGB by default, under pbrt-v2's conventions as linear.
Plugin<TexturePtr, const TextureArgs&> imagemapTexturePlugin();

} // namespace strobe
