// "loopsubdiv": a Loop subdivision surface.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// The table row of the Loop subdivision surface; deforming when "keys" is above 1.
Plugin<Shape> loopSubdivPlugin();

} // namespace strobe
