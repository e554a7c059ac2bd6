// Shapes as they stand in the scene: built, placed, and moving over the shutter.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/transform.h"

namespace strobe {

/// A shape placed in the world. In a built scene a mesh's keys are uniform over the shutter (keyTimes[i] =
/// i/(n-1), shutter fractions), and the vertices of a still mesh outside instances are baked: toParent is the
/// identity.
struct PlacedShape {
    Shape shape;
    M44f toParent;                        ///< still part: object to its group's space
    std::shared_ptr<const Motion> motion; ///< group to world; null: identity
    bool reverseOrientation = false;      ///< the surface normal is the shape's own, turned round

    bool isStatic() const {
        return (!motion || motion->isStatic()) && !(shape.mesh && shape.mesh->deforms());
    }
    /// Object-to-world at shutter fraction `time`.
    M44f toWorld(float time) const { return motion ? toParent * motion->at(time) : toParent; }
};

/// The three vertices of a triangle, in object space, at shutter fraction `time`.
inline void triangleVertices(const TriangleMesh& mesh, uint32_t triangle, float time, V3f out[3]) {
    const uint32_t* index = &mesh.indices[3 * size_t(triangle)];
    if (!mesh.deforms()) {
        for (int k = 0; k < 3; ++k)
            out[k] = mesh.positions[0][index[k]];
        return;
    }
    const float x = time * float(mesh.positions.size() - 1);
    const size_t i = std::min(size_t(std::max(x, 0.f)), mesh.positions.size() - 2);
    for (int k = 0; k < 3; ++k)
        out[k] = lerp(mesh.positions[i][index[k]], mesh.positions[i + 1][index[k]], x - float(i));
}

/// The texture coordinates at barycentrics (u, v) of the second and third vertex.
inline V2f triangleUv(const TriangleMesh& mesh, uint32_t triangle, float u, float v) {
    if (mesh.uvs.empty())
        return {u + v, v}; // of (0,0) (1,0) (1,1)
    const uint32_t* index = &mesh.indices[3 * size_t(triangle)];
    return mesh.uvs[index[0]] * (1 - u - v) + mesh.uvs[index[1]] * u + mesh.uvs[index[2]] * v;
}

} // namespace strobe
