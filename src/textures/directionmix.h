// The "directionmix" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// pbrt-v4's directionmix: tex1 weighted by the magnitude of the cosine between the geometric normal and
/// `dir` (in the space of the texture), tex2 by the rest.
Plugin<TexturePtr, const TextureArgs&> directionMixTexturePlugin();

} // namespace strobe
