// The "sphere" shape.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// A sphere around the origin, clipped to zmin <= z <= zmax and 0 <= φ <= phimax. pbrt's parametrization:
/// u = φ / phimax, v = (θ - θmin) / (θmax - θmin) with θmin = acos(zmin / radius) and θmax = acos(zmax /
/// radius), so v is 0 at zmin.
Plugin<Shape> spherePlugin();

} // namespace strobe
