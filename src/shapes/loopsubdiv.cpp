#include "shapes/loopsubdiv.h"

#include "shapes/mesh_params.h"
#include "shapes/subdivision.h"

namespace strobe {
namespace {

using namespace mesh_params;

const ParamDef<int> kLevels{"nlevels", 3, "number of subdivisions of each triangle into four, 0 to 8",
                            "levels"};
const ParamDef<std::string> kScheme{"scheme", "loop", "subdivision scheme; only \"loop\""};

Shape createLoopSubdiv(const ParamSet& params, const BuildContext& context) {
    if (const std::string scheme = params.get(kScheme); scheme != "loop")
        throw Error(params.whereIs(kScheme), "unknown subdivision scheme \"" + scheme + "\" (known: loop)");
    const int levels = params.get(kLevels);
    if (levels < 0 || levels > 8)
        throw Error(params.whereIs(kLevels),
                    "\"nlevels\" must be between 0 and 8, not " + std::to_string(levels));
    const KeyedPoints control = readPositions(params);
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->keyTimes = readKeyTimes(params, control.size(), context);
    mesh->alpha = readAlpha(params, context);
    const std::vector<uint32_t> indices = readIndices(params, control.front().size());
    SubdividedMesh fine = subdivideLoop(indices, control, levels, params.whereIs(kIndices));
    mesh->indices = std::move(fine.indices);
    mesh->positions = std::move(fine.positions);
    mesh->normals = std::move(fine.normals);
    if (context.isLenient) // pbrt takes the neighbors of a vertex clockwise
        for (auto& key : mesh->normals)
            for (V3f& n : key)
                n = -n;
    return {mesh, nullptr};
}

} // namespace

Plugin<Shape> loopSubdivPlugin() {
    return {"loopsubdiv",
            "Loop subdivision surface, static or deforming",
            {kLevels, kScheme, kIndices, kP, kKeys, kKeyTimes, kAlpha, kShadowAlpha},
            createLoopSubdiv};
}

} // namespace strobe
