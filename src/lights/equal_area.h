// The equal-area octahedral mapping of pbrt-v4's environment maps (Clarberg, "Fast Equal-Area Mapping of the
// (Hemi)Sphere using SIMD", 2008).
#pragma once

#include "core/image/image.h"

namespace strobe {

/// Returns the point of the unit square for a unit direction. The center is +z, the corners are -z.
V2f equalAreaPoint(const V3f& w);

/// Resamples a square equal-area map to a latitude-longitude image of the same height and twice the width.
Image toLatitudeLongitude(const Image& equalArea);

} // namespace strobe
