// The "disk" shape.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A disk, annulus or sector in the plane z = height, with normal +z. pbrt's parametrization:
/// u = φ / phimax, v = (radius - r) / (radius - innerradius), so v is 0 at the outer edge.
Plugin<Shape> diskPlugin();

} // namespace strobe
