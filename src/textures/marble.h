// The "marble" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// pbrt's marble: a spline of stone colors over a sine of y, whose phase is disturbed by fbm. In files of
/// pbrt-v3, the spline is that of v3, whose colors exceed 1.
Plugin<TexturePtr, const TextureArgs&> marbleTexturePlugin();

} // namespace strobe
