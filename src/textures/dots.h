// The "dots" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// pbrt's dots: two fifths of the unit squares of texture space, picked by noise, contain a disk of radius
/// 0.35.
/// Point-sampled, as in pbrt. In .pbrt files, `inside` is the value around the dots, and `outside` that in
/// the dots: so do all versions of pbrt.
Plugin<TexturePtr, const TextureArgs&> dotsTexturePlugin();

} // namespace strobe
