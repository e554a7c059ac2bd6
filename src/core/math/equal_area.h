// The equal-area octahedral mapping between directions and the unit square (Clarberg, "Fast Equal-Area
// Mapping of the (Hemi)Sphere using SIMD", 2008), as in pbrt-v4.
#pragma once

#include "core/math/api.h"
#include "core/math/math.h"

namespace STROBE_API strobe {

/// Returns the point of the unit square for a unit direction. The center is +z, the corners are -z.
V2f equalAreaPoint(const V3f& w);

/// Returns the unit direction of a point of the plane; the inverse of equalAreaPoint. Up to one unit beyond
/// an edge, the square continues as on an octahedron: the edge is mirrored at its center.
V3f equalAreaDirection(V2f p);

} // namespace strobe
