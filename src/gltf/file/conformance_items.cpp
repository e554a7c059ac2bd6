#include "gltf/file/conformance_items.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <set>

namespace strobe::gltf {
namespace {

using nlohmann::json;

constexpr int kUnsignedInt = 5125, kFloat = 5126;

const json& nothing() {
    static const json null;
    return null;
}
/// Returns a member; null if it is missing or if `value` is no object.
const json& get(const json& value, const char* member) {
    if (!value.is_object())
        return nothing();
    const auto it = value.find(member);
    return it == value.end() ? nothing() : *it;
}
/// Returns a member that is an array; an empty one if it is missing or something else.
const json& list(const json& value, const char* member) {
    static const json empty = json::array();
    const json& found = get(value, member);
    return found.is_array() ? found : empty;
}
double number(const json& value, const char* member, double fallback) {
    const json& n = get(value, member);
    return n.is_number() ? n.get<double>() : fallback;
}
bool has(const json& value, const char* member) { return value.is_object() && value.contains(member); }

class ItemChecker {
  public:
    ItemChecker(const json& root, Deviations& out) : m_root(root), m_out(out) {}

    void check() {
        forEach("accessors", [&](const json& a, const std::string& path) { checkAccessor(a, path); });
        forEach("bufferViews", [&](const json& v, const std::string& path) { checkView(v, path); });
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
        const json& items = strobe::gltf::list(m_root, list);
        for (size_t i = 0; i < items.size(); ++i)
            check(items[i], std::string(list) + "[" + std::to_string(i) + "]");
    }
    /// Returns an item of a root list; null if there is none.
    const json& item(const char* list, const json& index) const {
        const json& items = strobe::gltf::list(m_root, list);
        const bool exists = index.is_number_unsigned() && index.get<size_t>() < items.size();
        return exists ? items[index.get<size_t>()] : nothing();
    }
    void range(const json& value, const char* member, double least, double greatest,
               const std::string& path) {
        json numbers = get(value, member);
        if (!numbers.is_array())
            numbers = json::array({numbers});
        for (const json& n : numbers)
            if (n.is_number() && !(n.get<double>() >= least && n.get<double>() <= greatest))
                add(path + "." + member, n.dump() + " is out of range");
    }

    void checkAccessor(const json& a, const std::string& path) {
        const json& type = get(a, "componentType");
        if (get(a, "normalized") == true && (type == kFloat || type == kUnsignedInt))
            add(path + ".normalized", "must not be true for this componentType");
        if (has(a, "byteOffset") && !has(a, "bufferView"))
            add(path + ".byteOffset", "needs a bufferView");
        range(a, "count", 1, 1e18, path);
    }
    void checkView(const json& v, const std::string& path) {
        const json& buffer = item("buffers", get(v, "buffer"));
        const double end = number(v, "byteOffset", 0) + number(v, "byteLength", 0);
        if (buffer.is_object() && end > number(buffer, "byteLength", 0))
            add(path, "exceeds its buffer");
        if (has(v, "byteStride") && get(v, "target") == 34963)
            add(path + ".byteStride", "must not be set for indices");
        if (number(v, "byteStride", 0) > number(v, "byteLength", 0))
            add(path + ".byteStride", "exceeds the byteLength");
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
        range(get(extensions, "KHR_materials_emissive_strength"), "emissiveStrength", 0, 1e30, path);
        range(get(extensions, "KHR_materials_volume"), "thicknessFactor", 0, 1e30, path);
        range(get(extensions, "KHR_materials_volume"), "attenuationDistance", 1e-30, 1e38, path);
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
        if (!accessor.is_object() || name.starts_with("_"))
            return;
        if ((name == "POSITION" || name == "NORMAL") && type != "VEC3")
            add(path, "must be of type VEC3");
        if (name == "TANGENT" && type != "VEC4")
            add(path, "must be of type VEC4");
        if (kind == "TEXCOORD" && type != "VEC2")
            add(path, "must be of type VEC2");
        if (get(accessor, "componentType") == kUnsignedInt)
            add(path, "must not have 32-bit integers");
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
        const json& pbr = get(material, "pbrMetallicRoughness");
        for (const json& info : {get(pbr, "baseColorTexture"), get(pbr, "metallicRoughnessTexture"),
                                 get(material, "normalTexture"), get(material, "emissiveTexture"),
                                 get(material, "occlusionTexture")}) {
            const std::string set = "TEXCOORD_" + std::to_string(int(number(info, "texCoord", 0)));
            if (info.is_object() && !has(attributes, set.c_str()))
                add(path + ".material", "needs " + set);
        }
        if (has(material, "normalTexture") && !has(attributes, "TANGENT") && !has(attributes, "NORMAL"))
            add(path + ".material", "has a normal map, but the primitive has no normals");
    }

    void checkSkin(const json& s, const std::string& path) {
        const json& matrices = item("accessors", get(s, "inverseBindMatrices"));
        const json& joints = get(s, "joints");
        if (!matrices.is_object())
            return;
        if (get(matrices, "type") != "MAT4" || get(matrices, "componentType") != kFloat)
            add(path + ".inverseBindMatrices", "must be of type MAT4 and float");
        if (number(matrices, "count", 0) < double(joints.size()))
            add(path + ".inverseBindMatrices", "has fewer elements than there are joints");
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
        std::set<uint64_t> children;
        forEach("nodes", [&](const json& n, const std::string& path) {
            for (const json& child : list(n, "children"))
                if (child.is_number_unsigned())
                    children.insert(child.get<uint64_t>());
            if (has(n, "matrix") && (has(n, "translation") || has(n, "rotation") || has(n, "scale")))
                add(path, "must have either a matrix, or translation, rotation and scale");
            double norm = list(n, "rotation").empty() ? 1 : 0;
            for (const json& x : list(n, "rotation"))
                norm += x.is_number() ? x.get<double>() * x.get<double>() : 0;
            if (std::abs(norm - 1) > 1e-2)
                add(path + ".rotation", "is not a unit quaternion");
            for (const char* needsMesh : {"skin", "weights"})
                if (has(n, needsMesh) && !has(n, "mesh"))
                    add(path + "." + needsMesh, "needs a mesh");
            checkSkinned(n, path);
        });
        forEach("scenes", [&](const json& s, const std::string& path) {
            for (const json& node : list(s, "nodes"))
                if (node.is_number_unsigned() && children.count(node.get<uint64_t>()))
                    add(path + ".nodes", "node " + node.dump() + " is a child of another node");
        });
    }
    void checkSkinned(const json& n, const std::string& path) {
        const json& primitives = get(item("meshes", get(n, "mesh")), "primitives");
        for (size_t i = 0; has(n, "skin") && primitives.is_array() && i < primitives.size(); ++i)
            if (!has(get(primitives[i], "attributes"), "JOINTS_0"))
                add(path + ".skin", "the mesh has no joints");
    }

    const json& m_root;
    Deviations& m_out;
};

} // namespace

void checkItems(const json& root, Deviations& out) { ItemChecker(root, out).check(); }

} // namespace strobe::gltf
