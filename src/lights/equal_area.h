// pbrt-v4's environment maps: squares on which equal areas are equal solid angles (Clarberg, "Fast Equal-Area
// Mapping of the (Hemi)Sphere using SIMD", 2008).
#pragma once

#include "core/image/image.h"

namespace strobe {

/// The point of the unit square for a unit direction; the center is +z, the corners are -z.
V2f equalAreaPoint(const V3f& w);

/// The same light as a latitude-longitude image, as high as the square.
Image latitudeLongitudeOf(const Image& equalArea);

} // namespace strobe
