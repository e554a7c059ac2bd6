// Environment maps in pbrt-v4's equal-area octahedral mapping.
#pragma once

#include "core/image/image.h"
#include "core/math/equal_area.h"

namespace strobe {

/// Returns the bilinearly interpolated pixel of an equal-area map at `p` in [0,1]². Beyond an edge, pixels
/// wrap as on an octahedron: the edge is mirrored at its center.
Rgb equalAreaLookup(const Image& image, const V2f& p);

/// Resamples a square equal-area map to a latitude-longitude image of the same height and twice the width.
Image toLatitudeLongitude(const Image& equalArea);

} // namespace strobe
