// The stochastic alpha test of triangle meshes.
#pragma once

#include "core/interfaces/shape.h"

namespace strobe {

/// Returns whether a ray hits a triangle at the barycentrics (u, v): whether alpha is above a number in [0,1)
/// hashed from the ray, the triangle and the seed. The expected coverage of the surface is alpha, and equal
/// rays give equal results. o, d: origin and direction of the ray.
bool passesAlphaTest(const TriangleMesh& mesh, uint32_t seed, uint32_t prim, float u, float v, const V3f& o,
                     const V3f& d);

} // namespace strobe
