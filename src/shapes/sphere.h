// "sphere": a sphere about the origin, or the part of it that zmin, zmax and phimax leave.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// The table row of the sphere.
Plugin<Shape> spherePlugin();

} // namespace strobe
