// Deforming meshes with keys that are uniform over the shutter, as Embree needs them.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/transform.h"

namespace strobe {

/// Returns the bounds of all vertices at all keys.
Box3f meshBounds(const TriangleMesh& mesh);

/// Returns a copy of `source` whose keys are uniform over the shutter: keyTimes are shutter fractions. It has
/// the fewest segments (at most 128) with which every vertex stays within `tolerance`, in the mesh's units,
/// of the source's motion, and a single key if the mesh is static during the shutter. `source.keyTimes` are
/// scene times, between which positions are interpolated linearly.
std::shared_ptr<TriangleMesh> fitDeformation(const TriangleMesh& source, const Shutter& shutter,
                                             float tolerance);

} // namespace strobe
