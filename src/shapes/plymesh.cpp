#include "shapes/plymesh.h"

#include "shapes/mesh_params.h"
#include "shapes/ply.h"

namespace strobe {
namespace {

using namespace mesh_params;

const ParamDef<std::vector<std::string>> kFilename{
    "filename", {}, "PLY file; several files of the same topology are the keys of a deforming mesh"};

PlyMesh readKey(const std::string& name, const Location& where, const BuildContext& context) {
    PlyMesh ply = readPlyFile(resolveFile(name, where), where, context.isLenient);
    if (ply.trailingBytes > 0)
        context.diagnostics.warn(where, "\"" + name + "\": " + std::to_string(ply.trailingBytes) +
                                            " bytes after the last element are ignored");
    requireFinite(ply.positions, "position", "", where);
    checkNormals(ply.normals, "", where, context);
    return ply;
}

/// Throws a located Error unless the keys differ in the values of positions and normals only.
void requireSameTopology(const PlyMesh& first, const PlyMesh& key, const std::string& firstName,
                         const std::string& name, const Location& where) {
    const std::string files = "\"" + name + "\" cannot be a key of the same mesh as \"" + firstName + "\": ";
    if (key.positions.size() != first.positions.size())
        throw Error(where, files + std::to_string(key.positions.size()) + " vertices instead of " +
                               std::to_string(first.positions.size()));
    if (key.indices != first.indices)
        throw Error(where, files + "the faces differ");
    if (key.normals.empty() != first.normals.empty())
        throw Error(where, files + "only one of the files has normals");
}

Shape createPlyMesh(const ParamSet& params, const BuildContext& context) {
    const std::vector<std::string> names = params.require(kFilename);
    const Location where = params.whereIs(kFilename);
    if (names.empty())
        throw Error(where, "\"filename\" names no file");
    PlyMesh first = readKey(names.front(), where, context);
    if (first.indices.empty()) {
        params.markAllUsed();
        warnOfEmptyMesh(where, context);
        return {};
    }
    auto mesh = std::make_shared<TriangleMesh>();
    const auto addKey = [&](PlyMesh& ply) {
        mesh->positions.push_back(std::move(ply.positions));
        if (!ply.normals.empty())
            mesh->normals.push_back(std::move(ply.normals));
    };
    std::vector<PlyMesh> others;
    for (size_t k = 1; k < names.size(); ++k) {
        others.push_back(readKey(names[k], where, context));
        requireSameTopology(first, others.back(), names.front(), names[k], where);
        others.back().indices = {}; // frees memory: equal to the first
    }
    mesh->indices = std::move(first.indices);
    mesh->uvs = std::move(first.uvs);
    addKey(first);
    for (PlyMesh& key : others)
        addKey(key);
    mesh->keyTimes = readKeyTimes(params, names.size(), context);
    mesh->alpha = readAlpha(params, context);
    return {mesh, nullptr};
}

} // namespace

Plugin<Shape> plyMeshPlugin() {
    return {"plymesh",
            "triangles of a PLY file (ASCII or binary), static or deforming",
            {kFilename, kKeyTimes, kAlpha, kShadowAlpha},
            createPlyMesh};
}

} // namespace strobe
