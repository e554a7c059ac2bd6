// "loopsubdiv": a Loop subdivision surface.
#pragma once

#include "core/plugin.h"
#include "core/shape.h"

namespace strobe {

/// The table row of the Loop subdivision surface; deforming when "keys" is above 1.
Plugin<Shape> loopSubdivPlugin();

} // namespace strobe
