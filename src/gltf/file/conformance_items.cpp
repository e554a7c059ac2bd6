#include "gltf/file/conformance_items.h"

#include "gltf/file/json_access.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace strobe::gltf {
namespace {

constexpr int kUnsignedInt = 5125, kFloat = 5126;

class ItemChecker {
  public:
    ItemChecker(const json& root, Deviations& out) : m_root(root), m_out(out) {}

    void check() {
        findParents();
        checkLights();
        forEach("cameras", [&](const json& c, const std::string& path) { checkCamera(c, path); });
        forEach("images", [&](const json& i, const std::string& path) { checkImage(i, path); });
        forEach("materials", [&](const json& m, const std::string& path) { checkMaterial(m, path); });
        forEach("meshes", [&](const json& m, const std::string& path) { checkMesh(m, path); });
        forEach("skins", [&](const json& s, const std::string& path) { checkSkin(s, path); });
        forEach("animations", [&](const json& a, const std::string& path) { checkAnimation(a, path); });
        checkNodes();
        const json& asset = get(m_root, "asset");
        if (has(asset, "minVersion") && get(asset, "minVersion") > get(asset, "version"))
            add("asset.minVersion", "is greater than the version");
    }

  private:
    void add(const std::string& path, const std::string& message) { m_out.emplace_back(path, message); }
    template <class Check>
    void forEach(const char* list, const Check& check) {
        const json& items = listIn(m_root, list);
        for (size_t i = 0; i < items.size(); ++i)
            check(items[i], std::string(list) + "[" + std::to_string(i) + "]");
    }
    /// Returns an item of a root list; null if there is none.
    const json& item(const char* list, const json& index) const { return itemOf(m_root, list, index); }
    void range(const json& value, const char* member, double least, double greatest,
               const std::string& path) {
        json numbers = get(value, member);
        if (!numbers.is_array())
            numbers = json::array({numbers});
        for (const json& n : numbers)
            if (n.is_number() && !(n.get<double>() >= least && n.get<double>() <= greatest))
                add(path + "." + member, n.dump() + " is out of range");
    }

    void checkCamera(const json& c, const std::string& path) {
        if (has(c, "perspective") && has(c, "orthographic"))
            add(path, "must have either perspective or orthographic");
        for (const char* kind : {"perspective", "orthographic"}) {
            const json& lens = get(c, kind);
            if (has(lens, "zfar") && number(lens, "zfar", 0) <= number(lens, "znear", 0))
                add(path + "." + kind + ".zfar", "must be greater than znear");
            range(lens, "yfov", 1e-30, 3.14159, path + "." + kind);
            range(lens, "aspectRatio", 1e-30, 1e30, path + "." + kind);
            for (const char* size : {"xmag", "ymag"})
                if (has(lens, size) && number(lens, size, 1) == 0)
                    add(path + "." + kind + "." + size, "must not be 0");
        }
    }
    void checkImage(const json& i, const std::string& path) {
        const json& type = get(i, "mimeType");
        if (has(i, "bufferView") && !has(i, "mimeType"))
            add(path, "needs a mimeType, since it has a bufferView");
        if (type.is_string() && type != "image/png" && type != "image/jpeg")
            add(path + ".mimeType", type.dump() + " is not image/png or image/jpeg");
        const json& uri = get(i, "uri");
        const std::string text = uri.is_string() ? uri.get<std::string>() : "";
        if (text.starts_with("data:") && !text.starts_with("data:image/png") &&
            !text.starts_with("data:image/jpeg"))
            add(path + ".uri", "is a data URI of neither image/png nor image/jpeg");
    }
    void checkLights() {
        const json& lights = get(get(m_root, "extensions"), "KHR_lights_punctual");
        const std::string path = "extensions.KHR_lights_punctual";
        if (lights.is_object() && !has(lights, "lights"))
            add(path, "has no lights");
        const json& items = listIn(lights, "lights");
        for (size_t i = 0; i < items.size(); ++i)
            if (const json& spot = get(items[i], "spot");
                number(spot, "outerConeAngle", .7853982) <= number(spot, "innerConeAngle", 0))
                add(path + ".lights[" + std::to_string(i) + "].spot",
                    "outerConeAngle must be greater than innerConeAngle");
    }
    void checkMaterial(const json& m, const std::string& path) {
        const json& pbr = get(m, "pbrMetallicRoughness");
        for (const char* factor : {"baseColorFactor", "metallicFactor", "roughnessFactor"})
            range(pbr, factor, 0, 1, path + ".pbrMetallicRoughness");
        range(m, "emissiveFactor", 0, 1, path);
        range(m, "alphaCutoff", 0, 1e30, path);
        if (has(m, "alphaCutoff") && get(m, "alphaMode") != "MASK")
            add(path + ".alphaCutoff", "needs the alphaMode MASK");
        range(get(m, "occlusionTexture"), "strength", 0, 1, path + ".occlusionTexture");
        const json& extensions = get(m, "extensions");
        for (const char* name :
             {"clearcoat", "transmission", "iridescence", "sheen", "specular", "anisotropy"}) {
            const std::string full = std::string("KHR_materials_") + name;
            for (const char* factor : {"Factor", "RoughnessFactor", "ColorFactor", "Strength"})
                if (std::string(name) != "specular" || std::string(factor) != "ColorFactor")
                    range(get(extensions, full.c_str()), (name + std::string(factor)).c_str(), 0, 1,
                          path + ".extensions." + full);
        }
        const auto extensionRange = [&](const std::string& name, const char* member, double least,
                                        double greatest) {
            range(get(extensions, name.c_str()), member, least, greatest, path + ".extensions." + name);
        };
        extensionRange("KHR_materials_emissive_strength", "emissiveStrength", 0, 1e30);
        extensionRange("KHR_materials_volume", "thicknessFactor", 0, 1e30);
        extensionRange("KHR_materials_volume", "attenuationDistance", 1e-30, 1e38);
        const double ior = number(get(extensions, "KHR_materials_ior"), "ior", 1.5);
        if (ior != 0 && ior < 1)
            add(path + ".extensions.KHR_materials_ior.ior", "must be 0 or at least 1");
    }

    void checkMesh(const json& m, const std::string& path) {
        const json& primitives = get(m, "primitives");
        size_t targets = 0;
        for (size_t i = 0; primitives.is_array() && i < primitives.size(); ++i) {
            const size_t count = get(primitives[i], "targets").size();
            targets = i == 0 ? count : targets;
            const std::string primitivePath = path + ".primitives[" + std::to_string(i) + "]";
            if (count != targets)
                add(primitivePath + ".targets", "differ in number from those of the first primitive");
            checkPrimitive(primitives[i], primitivePath);
        }
        if (const json& weights = get(m, "weights"); weights.is_array() && weights.size() != targets)
            add(path + ".weights", "differ in number from the morph targets");
    }
    void checkPrimitive(const json& p, const std::string& path) {
        const json& attributes = get(p, "attributes");
        if (!attributes.is_object())
            return;
        if (!has(attributes, "POSITION"))
            add(path + ".attributes", "POSITION is missing");
        json count;
        for (const auto& [name, index] : attributes.items()) {
            const json& accessor = item("accessors", index);
            const std::string attributePath = path + ".attributes." + name;
            checkAttribute(name, accessor, attributePath);
            count = count.is_null() ? get(accessor, "count") : count;
            if (accessor.is_object() && get(accessor, "count") != count)
                add(attributePath, "has another number of elements than other attributes");
        }
        const json& position = item("accessors", get(attributes, "POSITION"));
        if (position.is_object() && !(has(position, "min") && has(position, "max")))
            add(path + ".attributes.POSITION", "needs min and max");
        for (int set = 0; has(attributes, ("JOINTS_" + std::to_string(set)).c_str()) ||
                          has(attributes, ("WEIGHTS_" + std::to_string(set)).c_str());
             ++set)
            if (has(attributes, ("JOINTS_" + std::to_string(set)).c_str()) !=
                has(attributes, ("WEIGHTS_" + std::to_string(set)).c_str()))
                add(path + ".attributes", "JOINTS and WEIGHTS must be used together");
        checkTargets(p, attributes, path);
        checkTextures(p, attributes, path);
        const json& indices = item("accessors", get(p, "indices"));
        if (indices.is_object() &&
            (get(indices, "type") != "SCALAR" || get(indices, "componentType") == kFloat ||
             get(indices, "normalized") == true))
            add(path + ".indices", "must be unsigned integers");
    }
    void checkAttribute(const std::string& name, const json& accessor, const std::string& path) {
        const std::string kind = name.substr(0, name.find_last_of('_'));
        static const std::set<std::string> plain{"POSITION", "NORMAL", "TANGENT"};
        static const std::set<std::string> sets{"TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"};
        const std::string number = kind.size() < name.size() ? name.substr(kind.size() + 1) : "";
        const bool isSet = sets.count(kind) && !number.empty() &&
                           number.find_first_not_of("0123456789") == std::string::npos &&
                           (number == "0" || number[0] != '0');
        if (!plain.count(name) && !isSet && !name.starts_with("_"))
            add(path, "is not the name of an attribute");
        const json& type = get(accessor, "type");
        if (get(accessor, "componentType") == kUnsignedInt)
            add(path, "must not have 32-bit integers");
        if (!accessor.is_object() || name.starts_with("_"))
            return;
        if ((name == "POSITION" || name == "NORMAL") && type != "VEC3")
            add(path, "must be of type VEC3");
        if (name == "TANGENT" && type != "VEC4")
            add(path, "must be of type VEC4");
        if (kind == "TEXCOORD" && type != "VEC2")
            add(path, "must be of type VEC2");
    }
    void checkTargets(const json& p, const json& attributes, const std::string& path) {
        const json& targets = get(p, "targets");
        const json& count = get(item("accessors", get(attributes, "POSITION")), "count");
        for (size_t i = 0; targets.is_array() && i < targets.size(); ++i)
            for (const auto& [name, index] : targets[i].items()) {
                const std::string targetPath = path + ".targets[" + std::to_string(i) + "]." + name;
                const json& accessor = item("accessors", index);
                if (!has(attributes, name.c_str()))
                    add(targetPath, "the primitive has no such attribute");
                if (accessor.is_object() && !count.is_null() && get(accessor, "count") != count)
                    add(targetPath, "has another number of elements than the primitive");
                if (name == "POSITION" && accessor.is_object() && !has(accessor, "min"))
                    add(targetPath, "needs min and max");
            }
    }
    void checkTextures(const json& p, const json& attributes, const std::string& path) {
        const json& material = item("materials", get(p, "material"));
        checkTextureSets(material, attributes, path);
        if (has(attributes, "TANGENT"))
            return;
        if (has(material, "normalTexture") && !has(attributes, "NORMAL"))
            add(path + ".material", "has a normal map, but the primitive has no normals");
        const json& extensions = get(material, "extensions");
        const bool needsTangents = has(get(extensions, "KHR_materials_anisotropy"), "anisotropyTexture") ||
                                   has(get(extensions, "KHR_materials_clearcoat"), "clearcoatNormalTexture");
        if (needsTangents && !has(material, "normalTexture"))
            add(path + ".material", "needs tangents");
    }
    /// Checks that the primitive has the texture coordinates of all textures below a value.
    void checkTextureSets(const json& value, const json& attributes, const std::string& path) {
        for (const auto& [name, member] : value.items()) {
            if (!member.is_object())
                continue;
            if (name.ends_with("Texture")) {
                const double set = number(get(get(member, "extensions"), "KHR_texture_transform"), "texCoord",
                                          number(member, "texCoord", 0));
                if (const std::string needed = "TEXCOORD_" + json(uint64_t(std::clamp(set, 0., 1e9))).dump();
                    !has(attributes, needed.c_str()))
                    add(path + ".material", "needs " + needed);
            } else {
                checkTextureSets(member, attributes, path);
            }
        }
    }

    void checkSkin(const json& s, const std::string& path) {
        const json& matrices = item("accessors", get(s, "inverseBindMatrices"));
        const json& joints = listIn(s, "joints");
        checkRoots(s, joints, path);
        if (!matrices.is_object())
            return;
        if (get(matrices, "type") != "MAT4" || get(matrices, "componentType") != kFloat)
            add(path + ".inverseBindMatrices", "must be of type MAT4 and float");
        if (number(matrices, "count", 0) < double(joints.size()))
            add(path + ".inverseBindMatrices", "has fewer elements than there are joints");
    }
    /// Checks that joints have a common root, and that the skeleton is one.
    void checkRoots(const json& s, const json& joints, const std::string& path) {
        std::set<uint64_t> common;
        for (size_t i = 0; i < joints.size(); ++i) {
            const std::set<uint64_t> above = ancestors(joints[i]);
            if (i == 0)
                common = above;
            else
                std::erase_if(common, [&](uint64_t node) { return !above.count(node); });
        }
        if (common.empty() && !joints.empty())
            add(path + ".joints", "have no common root");
        else if (const json& skeleton = get(s, "skeleton");
                 skeleton.is_number_unsigned() && !common.count(skeleton.get<uint64_t>()))
            add(path + ".skeleton", "is not a common root of the joints");
    }
    /// Returns a node and the nodes above it. Stops at cycles.
    std::set<uint64_t> ancestors(const json& node) const {
        std::set<uint64_t> out;
        for (uint64_t i = node.is_number_unsigned() ? node.get<uint64_t>() : kNone;
             i != kNone && out.insert(i).second;)
            i = m_parents.count(i) ? m_parents.at(i) : kNone;
        return out;
    }
    void findParents() {
        const json& nodes = listIn(m_root, "nodes");
        for (size_t i = 0; i < nodes.size(); ++i)
            for (const json& child : listIn(nodes[i], "children"))
                if (child.is_number_unsigned())
                    m_parents[child.get<uint64_t>()] = i;
    }

    void checkAnimation(const json& a, const std::string& path) {
        const json& samplers = get(a, "samplers");
        const json& channels = get(a, "channels");
        std::set<json> targets;
        for (size_t i = 0; channels.is_array() && i < channels.size(); ++i) {
            const std::string channelPath = path + ".channels[" + std::to_string(i) + "]";
            const json& target = get(channels[i], "target");
            const json& sampler = get(channels[i], "sampler");
            if (sampler.is_number_unsigned() && sampler.get<size_t>() >= samplers.size())
                add(channelPath + ".sampler", "there is no sampler " + sampler.dump());
            if (has(item("nodes", get(target, "node")), "matrix"))
                add(channelPath + ".target.node", "has a matrix, which cannot be animated");
            if (has(target, "node") && !targets.insert(target).second)
                add(channelPath, "animates the same property as another channel");
        }
        for (size_t i = 0; samplers.is_array() && i < samplers.size(); ++i) {
            const std::string inputPath = path + ".samplers[" + std::to_string(i) + "].input";
            const json& input = item("accessors", get(samplers[i], "input"));
            if (!input.is_object())
                continue;
            if (get(input, "type") != "SCALAR" || get(input, "componentType") != kFloat)
                add(inputPath, "must be of type SCALAR and float");
            if (!has(input, "min") || !has(input, "max"))
                add(inputPath, "needs min and max");
            if (get(samplers[i], "interpolation") == "CUBICSPLINE" && number(input, "count", 0) < 2)
                add(inputPath, "CUBICSPLINE needs two keys");
        }
    }

    void checkNodes() {
        forEach("nodes", [&](const json& n, const std::string& path) {
            if (has(n, "matrix") && (has(n, "translation") || has(n, "rotation") || has(n, "scale")))
                add(path, "must have either a matrix, or translation, rotation and scale");
            double norm = listIn(n, "rotation").empty() ? 1 : 0;
            for (const json& x : listIn(n, "rotation"))
                norm += x.is_number() ? x.get<double>() * x.get<double>() : 0;
            if (std::abs(norm - 1) > 1e-2)
                add(path + ".rotation", "is not a unit quaternion");
            const json& light = get(get(n, "extensions"), "KHR_lights_punctual");
            if (light.is_object() && !has(light, "light"))
                add(path + ".extensions.KHR_lights_punctual", "has no light");
            for (const char* needsMesh : {"skin", "weights"})
                if (has(n, needsMesh) && !has(n, "mesh"))
                    add(path + "." + needsMesh, "needs a mesh");
            checkSkinned(n, path);
        });
        forEach("scenes", [&](const json& s, const std::string& path) {
            for (const json& node : listIn(s, "nodes"))
                if (node.is_number_unsigned() && m_parents.count(node.get<uint64_t>()))
                    add(path + ".nodes", "node " + node.dump() + " is a child of another node");
        });
    }
    void checkSkinned(const json& n, const std::string& path) {
        const json& primitives = get(item("meshes", get(n, "mesh")), "primitives");
        for (size_t i = 0; has(n, "skin") && primitives.is_array() && i < primitives.size(); ++i)
            if (!has(get(primitives[i], "attributes"), "JOINTS_0"))
                add(path + ".skin", "the mesh has no joints");
    }

    static constexpr uint64_t kNone = ~uint64_t(0);
    const json& m_root;
    Deviations& m_out;
    std::map<uint64_t, uint64_t> m_parents;
};

} // namespace

void checkItems(const json& root, Deviations& out) { ItemChecker(root, out).check(); }

} // namespace strobe::gltf
