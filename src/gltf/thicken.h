// Points and lines as surfaces: spheres and tubes.
#pragma once

#include "core/math/math.h"

#include <array>
#include <vector>

namespace strobe::gltf {

/// Spheres and tubes around points and segments.
struct ThickSurface {
    std::vector<V3f> positions, normals;
    std::vector<uint32_t> indices; ///< three per triangle; counterclockwise from outside
    std::vector<uint32_t> sources; ///< by vertex: the index of the point that it surrounds
};

using Segment = std::array<uint32_t, 2>; ///< indices of the end points

/// Returns the vertices of the surfaces of this many points and segments, in total.
size_t thickVertexCount(size_t points, size_t segments);

/// Returns a sphere around each of the points `isolated`, and a tube with round ends around each segment.
/// Segments without length become spheres. `radius` is positive.
ThickSurface thicken(const std::vector<V3f>& points, const std::vector<uint32_t>& isolated,
                     const std::vector<Segment>& segments, float radius);

} // namespace strobe::gltf
