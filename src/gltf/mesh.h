// Meshes: the triangles of glTF primitives, with their morph targets and skin weights.
#pragma once

#include "core/interfaces/shape.h"
#include "core/util/diagnostics.h"
#include "gltf/file/document.h"

#include <map>

namespace strobe::gltf {

/// Displacements of a morph target; an array is empty if the target does not change that attribute.
struct MorphTarget {
    std::vector<V3f> positions, normals;
};

/// Joints and weights of all vertices, `perVertex` each; the weights of a vertex add up to 1.
struct SkinWeights {
    size_t perVertex = 0; ///< 0: not skinned
    std::vector<uint32_t> joints;
    std::vector<float> weights;
};

/// The triangles of one primitive, before deformation: one key, in the space of the mesh.
struct Primitive {
    std::string jsonPath;                   ///< "meshes[0].primitives[1]"
    TriangleMesh mesh;                      ///< without uvs: see MaterialBinding::uvSet
    int material = -1;                      ///< -1: the default material
    std::map<int, std::vector<V2f>> uvSets; ///< by index of TEXCOORD; v = 1 at an image's first row
    std::vector<Rgb> colors;                ///< COLOR_0, linear; empty: none
    std::vector<float> opacities;           ///< fourth component of COLOR_0; empty: none
    std::vector<MorphTarget> targets;
    SkinWeights skin;
};

/// Returns the primitives of mesh `index` as triangles. Points and lines become spheres and tubes of
/// `pointRadius`, in the space of the mesh; if it is 0, they are skipped with a warning. Throws Errors that
/// name the JSON path.
std::vector<Primitive> readMesh(const Document& document, size_t index, float pointRadius,
                                Diagnostics& diagnostics);

/// Returns the number of morph targets of a mesh, which is that of its first primitive.
size_t morphTargetCount(const tinygltf::Mesh& mesh);

} // namespace strobe::gltf
