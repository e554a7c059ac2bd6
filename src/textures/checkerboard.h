// The "checkerboard" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// Squares (or, with dimension 3, cubes) of side 1 in texture space, alternating between two inputs: tex1
/// where floor(s) + floor(t) is even. Squares are box-filtered in closed form over the bounding box of the
/// footprint; cubes are point-sampled.
Plugin<TexturePtr, const TextureArgs&> checkerboardTexturePlugin();

} // namespace strobe
