// The default view of glTF files.
#pragma once

#include "core/math/transform.h"

#include <vector>

namespace strobe {

/// Returns the camera-to-world transform of a perspective camera that looks at the center of the points from
/// the front (+z in glTF), a little from the right and from above, and just shows all of them. `halfView`:
/// tangents of half the horizontal and half the vertical angle. Without points, shows the unit sphere.
KeyedTransform viewOf(const std::vector<V3f>& points, const V2f& halfView);

/// Returns the height (y) of the lowest point; 0 without points.
float lowestPoint(const std::vector<V3f>& points);
/// Returns the largest distance between points along an axis; 0 without points.
float extentOf(const std::vector<V3f>& points);

} // namespace strobe
