// Shapes with their transforms, as the scene stores them.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/transform.h"

namespace strobe {

/// A shape and its object-to-world transform. In a built scene, the keys of a mesh are equidistant over the
/// shutter interval (keyTimes[i] = i/(n-1), shutter fractions), and the vertices of static meshes outside
/// instances are in world space: toParent is the identity.
struct PlacedShape {
    Shape shape;
    M44f toParent;                        ///< static part of the transform: object space to group space
    std::shared_ptr<const Motion> motion; ///< group space to world; null: identity
    bool reverseOrientation = false;      ///< flips the surface normal of the shape

    bool isStatic() const {
        return (!motion || motion->isStatic()) && !(shape.mesh && shape.mesh->deforms());
    }
    /// Returns the object-to-world matrix at shutter fraction `time`.
    M44f toWorld(float time) const { return motion ? toParent * motion->at(time) : toParent; }
};

/// Writes the three vertices of a triangle at shutter fraction `time` to `out`, in object space.
/// Precondition: the keys of the mesh are equidistant over the shutter interval.
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

/// Returns the texture coordinates at the barycentrics (u, v) of the second and third vertex.
inline V2f triangleUv(const TriangleMesh& mesh, uint32_t triangle, float u, float v) {
    if (mesh.uvs.empty())
        return {u + v, v}; // interpolates (0,0) (1,0) (1,1)
    const uint32_t* index = &mesh.indices[3 * size_t(triangle)];
    return mesh.uvs[index[0]] * (1 - u - v) + mesh.uvs[index[1]] * u + mesh.uvs[index[2]] * v;
}

} // namespace strobe
