// Loop subdivision surfaces.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <vector>

namespace strobe {

/// A subdivided mesh. Vertices are on the limit surface. Normals converge to those of the limit surface with
/// the number of levels, and point to the side from which the control triangles are counter-clockwise. They
/// are not normalized: their length is that of pbrt.
struct SubdividedMesh {
    std::vector<uint32_t> indices;           ///< three per triangle; four times as many per level
    std::vector<std::vector<V3f>> positions; ///< one array per key
    std::vector<std::vector<V3f>> normals;   ///< one array per key
};

/// Subdivides a triangle mesh `levels` times and moves its vertices to the limit surface, with the rules of
/// pbrt: Loop ("Smooth Subdivision Surfaces Based on Triangles", 1987) with the weights of Warren (1995).
/// Boundaries depend on boundary vertices only and have no sharp corners. Non-manifold vertices do not move,
/// and non-manifold edges are split at their midpoints. All keys share the topology. Every index must be in
/// range; unused vertices are removed. Throws an Error at `where` if a triangle uses a vertex twice, if the
/// result has more than 2^26 triangles, or if it exceeds the memory limit.
SubdividedMesh subdivideLoop(const std::vector<uint32_t>& indices, const std::vector<std::vector<V3f>>& keys,
                             int levels, const Location& where);

} // namespace strobe
