// Meshes: the primitives of a glTF mesh as triangles, with what deforms them.
#pragma once

#include "core/interfaces/shape.h"
#include "gltf/document.h"

#include <map>

namespace strobe::gltf {

/// Displacements of one morph target; an array is empty where the target leaves that attribute alone.
struct MorphTarget {
    std::vector<V3f> positions, normals;
};

/// The joints that hold the vertices: `perVertex` of them each, with weights that add up to 1.
struct SkinWeights {
    size_t perVertex = 0; ///< 0: not skinned
    std::vector<uint32_t> joints;
    std::vector<float> weights;
};

/// Triangles of one material, at rest: one key, in the mesh's space.
struct Primitive {
    std::string place;                      ///< "meshes[0].primitives[1]"
    TriangleMesh mesh;                      ///< uvs are empty: which set they are is the material's choice
    int material = -1;                      ///< -1: the default material
    std::map<int, std::vector<V2f>> uvSets; ///< by the number of TEXCOORD; v = 1 at an image's first row
    std::vector<Rgb> colors;                ///< COLOR_0, linear; empty: none
    std::vector<float> opacities;           ///< its fourth component; empty: none
    std::vector<MorphTarget> targets;
    SkinWeights skin;
};

/// The primitives of mesh `index` that are triangles; of others, a warning. Throws Errors that name the
/// place.
std::vector<Primitive> readMesh(const Document& document, size_t index, Diagnostics& messages);

/// How many morph targets a mesh has: those of its first primitive.
size_t morphTargetCount(const tinygltf::Mesh& mesh);

} // namespace strobe::gltf
