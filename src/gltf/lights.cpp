#include "gltf/lights.h"

namespace strobe::gltf {
namespace {

constexpr float kLumensPerWatt = 683;

Rgb colorOf(const Document& document, const std::vector<double>& numbers, const std::string& jsonPath) {
    if (numbers.empty())
        return Rgb(1);
    if (numbers.size() != 3 || std::any_of(numbers.begin(), numbers.end(), [](double x) { return x < 0; }))
        document.fail(jsonPath, "must be three non-negative numbers");
    return {float(numbers[0]), float(numbers[1]), float(numbers[2])};
}

/// Returns light `index` of the file. `jsonPath`: that of the reference to it.
ImportedLight lightFrom(const Document& document, int index, const std::string& jsonPath, bool photometric,
                        Diagnostics& diagnostics) {
    const tinygltf::Light& source = document.at(document.model().lights, index, "light", jsonPath);
    const std::string lightPath = "extensions.KHR_lights_punctual." + item("lights", size_t(index));
    ImportedLight light;
    if (source.type == "point")
        light.kind = ImportedLight::Point;
    else if (source.type == "spot")
        light.kind = ImportedLight::Spot;
    else if (source.type == "directional")
        light.kind = ImportedLight::Directional;
    else
        document.fail(lightPath + ".type",
                      "unknown \"" + source.type + "\" (known: point, spot, directional)");
    if (source.intensity < 0)
        document.fail(lightPath + ".intensity", "must not be negative");
    light.intensity = colorOf(document, source.color, lightPath + ".color") *
                      (float(source.intensity) / (photometric ? kLumensPerWatt : 1));
    light.innerAngle = float(source.spot.innerConeAngle);
    light.outerAngle = float(source.spot.outerConeAngle);
    if (light.kind == ImportedLight::Spot &&
        !(light.innerAngle >= 0 && light.innerAngle <= light.outerAngle &&
          light.outerAngle <= kPi / 2 + 1e-4f))
        document.fail(lightPath + ".spot", "needs 0 <= innerConeAngle <= outerConeAngle <= pi/2");
    if (source.range > 0)
        document.warnOnce(diagnostics, "light range", lightPath + ".range",
                          "is ignored: light falls off with the inverse square of the distance");
    return light;
}

/// Returns the index of a node's light; null: none.
const tinygltf::Value* lightOf(const tinygltf::Node& node) {
    const auto it = node.extensions.find("KHR_lights_punctual");
    return it != node.extensions.end() && it->second.Has("light") ? &it->second.Get("light") : nullptr;
}

ImportedCamera cameraFrom(const Document& document, int index, const std::string& jsonPath) {
    const tinygltf::Camera& source = document.at(document.model().cameras, index, "camera", jsonPath);
    const std::string cameraPath = item("cameras", size_t(index));
    ImportedCamera camera;
    camera.isPerspective = source.type == "perspective";
    if (camera.isPerspective) {
        if (!(source.perspective.yfov > 0 && source.perspective.yfov < kPi - 1e-3))
            document.fail(cameraPath + ".perspective.yfov", "must be an angle between 0 and pi");
        camera.halfHeight = float(std::tan(source.perspective.yfov / 2));
        camera.aspect = float(std::max(source.perspective.aspectRatio, 0.));
        return camera;
    }
    if (source.type != "orthographic")
        document.fail(cameraPath + ".type",
                      "unknown \"" + source.type + "\" (known: perspective, orthographic)");
    const double x = std::abs(source.orthographic.xmag), y = std::abs(source.orthographic.ymag);
    if (!(x > 0 && y > 0))
        document.fail(cameraPath + ".orthographic", "xmag and ymag must not be 0");
    camera.halfHeight = float(y);
    camera.aspect = float(x / y);
    return camera;
}

} // namespace

std::vector<ImportedLight> importLights(const NodeTree& tree, const Clip& clip, bool photometric,
                                        Diagnostics& diagnostics) {
    const Document& document = tree.document();
    std::vector<ImportedLight> lights;
    for (const size_t node : tree.order()) {
        const tinygltf::Value* index = lightOf(document.model().nodes[node]);
        if (!index)
            continue;
        const std::string jsonPath = item("nodes", node) + ".extensions.KHR_lights_punctual.light";
        if (!index->IsInt())
            document.fail(jsonPath, "must be an integer");
        lights.push_back(lightFrom(document, index->GetNumberAsInt(), jsonPath, photometric, diagnostics));
        lights.back().node = node;
        lights.back().moves = tree.moves(node, clip);
    }
    return lights;
}

std::optional<ImportedCamera> importCamera(const NodeTree& tree, const std::string& name) {
    const Document& document = tree.document();
    const tinygltf::Model& model = document.model();
    std::vector<std::string> names;
    for (const size_t node : tree.order()) {
        const int index = model.nodes[node].camera;
        if (index < 0)
            continue;
        ImportedCamera camera = cameraFrom(document, index, item("nodes", node) + ".camera");
        const std::string& cameraName = model.cameras[size_t(index)].name;
        const std::string& nodeName = model.nodes[node].name;
        names.push_back(nodeName.empty() ? cameraName : nodeName);
        if (!name.empty() && name != cameraName && name != nodeName)
            continue;
        camera.node = node;
        return camera;
    }
    if (name.empty())
        return std::nullopt;
    std::string list;
    for (const std::string& known : names)
        list += (list.empty() ? "" : ", ") + known;
    document.fail("cameras", "there is no camera \"" + name + "\" in the scene" +
                                 (list.empty() ? "" : " (known: " + list + ")"));
}

} // namespace strobe::gltf
