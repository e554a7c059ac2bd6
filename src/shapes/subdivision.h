// Loop subdivision surfaces.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <vector>

namespace strobe {

/// A subdivided mesh. Vertices lie on the limit surface. Normals approach its own as levels grow, point to
/// the side from which the control triangles turn counter-clockwise, and are not unit: their length is
/// pbrt's.
struct SubdividedMesh {
    std::vector<uint32_t> indices;           ///< three per triangle; four times as many per level
    std::vector<std::vector<V3f>> positions; ///< one array per key
    std::vector<std::vector<V3f>> normals;   ///< one array per key
};

/// Subdivides a triangle mesh `levels` times and moves its vertices to the limit surface, with pbrt's rules:
/// Loop 1987 with the weights of Warren 1995; boundaries depend on boundaries alone and have no sharp
/// corners. Vertices and edges that are not manifold stay where they are. All keys share the topology. Every
/// index must be in range; vertices that no triangle uses are left out. Throws at `where` when a triangle
/// uses a vertex twice, or when the result would be too large to hold.
SubdividedMesh subdivideLoop(const std::vector<uint32_t>& indices, const std::vector<std::vector<V3f>>& keys,
                             int levels, const Location& where);

} // namespace strobe
