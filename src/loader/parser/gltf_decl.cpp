#include "loader/parser/gltf_decl.h"

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{"filename", {}, "glTF 2.0 file, .gltf or .glb"};
const ParamDef<std::string> kScene{"scene", "", "name of a scene of the file; default: the file's default"};
const ParamDef<std::string> kAnimation{
    "animation", "",
    "name of the animation; default: the first, and all later ones that animate other properties"};
const ParamDef<std::string> kCamera{
    "camera", "", "name of the file's camera, used if the scene has no Camera; default: the first"};
const ParamDef<bool> kLights{"lights", true, "whether to import the file's lights (KHR_lights_punctual)"};
const ParamDef<bool> kPhotometric{
    "photometric", true,
    "units of the file's lights: candela and lux are divided by 683 lm/W; false: taken as W/sr and W/m²"};
const ParamDef<bool> kCulling{
    "culling", false, "whether camera rays pass through the back of surfaces that are not doubleSided"};
const ParamDef<float> kPointRadius{
    "pointradius", 0, "radius of points and lines, in units of the file's scene; 0: they are skipped",
    nullptr, kNotNegative};

} // namespace

Plugin<Shape> gltfPlugin() {
    return {"gltf",
            "a glTF 2.0 file with its own materials and motion: docs/gltf.md",
            {kFilename, kScene, kAnimation, kCamera, kLights, kPhotometric, kCulling, kPointRadius},
            [](const ParamSet& params, const BuildContext&) -> Shape {
                throw Error(params.where(), "Shape \"gltf\" cannot be created as a single shape");
            }};
}

GltfDecl readGltf(const ParamSet& params, bool strict, Diagnostics& diagnostics) {
    const Location where = params.whereIs(kFilename);
    GltfDecl decl = readGltf(params.require(kFilename).path, where, where ? where.source->policy : nullptr);
    decl.settings = {params.get(kScene),      params.get(kAnimation),   params.get(kCamera),
                     params.get(kLights),     params.get(kPhotometric), params.get(kCulling),
                     params.get(kPointRadius)};
    params.reportUnused(gltfPlugin().params, strict, diagnostics);
    return decl;
}

GltfDecl readGltf(const std::filesystem::path& path, const Location& where,
                  std::shared_ptr<const ResourcePolicy> policy) {
    return {gltf::open(path, where, std::move(policy)), {}, {}, -1, where};
}

} // namespace strobe
