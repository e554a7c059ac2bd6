#include "shapes/trianglemesh.h"

#include "shapes/mesh_params.h"

namespace strobe {
namespace {

using namespace mesh_params;

const ParamDef<std::vector<V3f>> kS{"S", {}, "tangent vectors, one per vertex"};
const ParamDef<std::vector<V2f>> kUv{
    "uv", {}, "texture coordinates, one pair per vertex (float or point2)", "st"};

std::vector<V2f> readUvs(const ParamSet& params, size_t vertexCount) {
    if (!params.has(kUv))
        return {};
    const std::vector<V2f> uvs = params.get(kUv);
    if (uvs.size() != vertexCount)
        throw Error(params.whereIs(kUv), "\"uv\" has " + std::to_string(uvs.size()) +
                                             " pairs, but the mesh has " + std::to_string(vertexCount) +
                                             " vertices");
    for (size_t i = 0; i < uvs.size(); ++i) {
        if (!std::isfinite(uvs[i].x) || !std::isfinite(uvs[i].y))
            throw Error(params.whereIs(kUv), "the uv of vertex " + std::to_string(i) + " is not finite");
    }
    return uvs;
}

std::vector<V3f> readTangents(const ParamSet& params, size_t vertexCount) {
    if (!params.has(kS))
        return {};
    const std::vector<V3f> tangents = params.get(kS);
    if (tangents.size() != vertexCount)
        throw Error(params.whereIs(kS), "\"S\" has " + std::to_string(tangents.size()) +
                                            " vectors, but the mesh has " + std::to_string(vertexCount) +
                                            " vertices");
    requireFinite({tangents}, "tangent", params.whereIs(kS));
    return tangents;
}

bool isEmpty(const ParamSet& params) {
    return params.get(kP).empty() || (params.has(kIndices) && params.get(kIndices).empty());
}

Shape createTriangleMesh(const ParamSet& params, const BuildContext& context) {
    if (context.isLenient && isEmpty(params)) {
        params.markAllUsed();
        warnOfEmptyMesh(params.where(), context);
        return {};
    }
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->positions = readPositions(params);
    mesh->keyTimes = readKeyTimes(params, mesh->positions.size(), context);
    mesh->indices = readIndices(params, mesh->vertexCount());
    mesh->normals = readNormals(params, mesh->positions, context);
    mesh->tangents = readTangents(params, mesh->vertexCount());
    mesh->uvs = readUvs(params, mesh->vertexCount());
    mesh->alpha = readAlpha(params, context);
    return {mesh, nullptr};
}

} // namespace

Plugin<Shape> triangleMeshPlugin() {
    return {"trianglemesh",
            "triangles, static or deforming",
            {kIndices, kP, kN, kS, kUv, kKeys, kKeyTimes, kAlpha, kShadowAlpha},
            createTriangleMesh};
}

} // namespace strobe
