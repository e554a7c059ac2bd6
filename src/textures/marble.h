// The "marble" texture.
#pragma once

#include "core/params/plugin.h"

namespace strobe {

/// pbrt's marble: a spline of stone colors over a sine of y, whose phase is disturbed by fbm.
Plugin<TexturePtr, const TextureArgs&> marbleTexturePlugin();

} // namespace strobe
