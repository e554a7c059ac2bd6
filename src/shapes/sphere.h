// "sphere": a sphere about the origin, or the part of it that zmin, zmax and phimax leave.
#pragma once

#include "core/plugin.h"
#include "core/shape.h"

namespace strobe {

/// The table row of the sphere.
Plugin<Shape> spherePlugin();

} // namespace strobe
