#include "gltf/lights.h"

namespace strobe::gltf {
namespace {

constexpr float kLumensPerWatt = 683;

Rgb colorOf(const Document& document, const std::vector<double>& numbers, const std::string& place) {
    if (numbers.empty())
        return Rgb(1);
    if (numbers.size() != 3 || std::any_of(numbers.begin(), numbers.end(), [](double x) { return x < 0; }))
        document.fail(place, "must be three numbers from 0");
    return {float(numbers[0]), float(numbers[1]), float(numbers[2])};
}

ImportedLight lightFrom(const Document& document, int index, const std::string& place,
                        Diagnostics& messages) {
    const tinygltf::Light& source = document.at(document.model().lights, index, "light", place);
    const std::string there = "extensions.KHR_lights_punctual." + item("lights", size_t(index));
    ImportedLight light;
    if (source.type == "point")
        light.kind = ImportedLight::Point;
    else if (source.type == "spot")
        light.kind = ImportedLight::Spot;
    else if (source.type == "directional")
        light.kind = ImportedLight::Directional;
    else
        document.fail(there + ".type", "unknown \"" + source.type + "\" (known: point, spot, directional)");
    if (source.intensity < 0)
        document.fail(there + ".intensity", "must not be negative");
    light.intensity =
        colorOf(document, source.color, there + ".color") * (float(source.intensity) / kLumensPerWatt);
    light.innerAngle = float(source.spot.innerConeAngle);
    light.outerAngle = float(source.spot.outerConeAngle);
    if (light.kind == ImportedLight::Spot &&
        !(light.innerAngle >= 0 && light.innerAngle <= light.outerAngle &&
          light.outerAngle <= kPi / 2 + 1e-4f))
        document.fail(there + ".spot", "needs 0 <= innerConeAngle <= outerConeAngle <= pi/2");
    if (source.range > 0)
        document.warnOnce(messages, "light range", there + ".range",
                          "is ignored: light falls off with the square of the distance, and no faster");
    return light;
}

const tinygltf::Value* lightOf(const tinygltf::Node& node) {
    const auto it = node.extensions.find("KHR_lights_punctual");
    return it != node.extensions.end() && it->second.Has("light") ? &it->second.Get("light") : nullptr;
}

ImportedCamera cameraFrom(const Document& document, int index, const std::string& place) {
    const tinygltf::Camera& source = document.at(document.model().cameras, index, "camera", place);
    const std::string there = item("cameras", size_t(index));
    ImportedCamera camera;
    camera.isPerspective = source.type == "perspective";
    if (camera.isPerspective) {
        if (!(source.perspective.yfov > 0 && source.perspective.yfov < kPi - 1e-3))
            document.fail(there + ".perspective.yfov", "must be an angle between 0 and pi");
        camera.halfHeight = float(std::tan(source.perspective.yfov / 2));
        camera.aspect = float(std::max(source.perspective.aspectRatio, 0.));
        return camera;
    }
    if (source.type != "orthographic")
        document.fail(there + ".type", "unknown \"" + source.type + "\" (known: perspective, orthographic)");
    const double x = std::abs(source.orthographic.xmag), y = std::abs(source.orthographic.ymag);
    if (!(x > 0 && y > 0))
        document.fail(there + ".orthographic", "xmag and ymag must not be 0");
    camera.halfHeight = float(y);
    camera.aspect = float(x / y);
    return camera;
}

} // namespace

std::vector<ImportedLight> importLights(const NodeTree& tree, const Clip& clip, Diagnostics& messages) {
    const Document& document = tree.document();
    std::vector<ImportedLight> lights;
    for (const size_t node : tree.order()) {
        const tinygltf::Value* index = lightOf(document.model().nodes[node]);
        if (!index)
            continue;
        const std::string place = item("nodes", node) + ".extensions.KHR_lights_punctual.light";
        if (!index->IsInt())
            document.fail(place, "must be an integer");
        lights.push_back(lightFrom(document, index->GetNumberAsInt(), place, messages));
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
        const std::string &own = model.cameras[size_t(index)].name, &nodes = model.nodes[node].name;
        names.push_back(nodes.empty() ? own : nodes);
        if (!name.empty() && name != own && name != nodes)
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
                                 (list.empty() ? "" : " (there is: " + list + ")"));
}

} // namespace strobe::gltf
