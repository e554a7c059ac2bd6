#include "gltf/file/conformance.h"

#include "gltf/file/conformance_items.h"

#include "gltf/file/json_access.h"

#include <map>
#include <set>

namespace strobe::gltf {
namespace {

/// Returns the root list that an index refers to; null: the member is no index. `parent`: name of the object
/// that has the member.
const char* listOf(const std::string& member, const std::string& parent) {
    static const std::map<std::string, const char*> lists{{"bufferView", "bufferViews"},
                                                          {"buffer", "buffers"},
                                                          {"mesh", "meshes"},
                                                          {"skin", "skins"},
                                                          {"material", "materials"},
                                                          {"indices", "accessors"},
                                                          {"source", "images"},
                                                          {"scene", "scenes"},
                                                          {"input", "accessors"},
                                                          {"output", "accessors"},
                                                          {"node", "nodes"},
                                                          {"inverseBindMatrices", "accessors"},
                                                          {"skeleton", "nodes"},
                                                          {"camera", "cameras"}};
    if (member == "index")
        return parent.ends_with("Texture") ? "textures" : nullptr;
    if (member == "sampler")
        return parent == "textures" ? "samplers" : nullptr;
    if (parent == "attributes" || parent == "targets")
        return "accessors";
    const auto it = lists.find(member);
    return it == lists.end() ? nullptr : it->second;
}

/// Returns the list of nodes that an array refers to.
bool isNodeList(const std::string& member, const std::string& parent) {
    return (member == "nodes" && parent == "scenes") || member == "children" || member == "joints";
}

/// Returns whether an extension may be in an object; true for unknown extensions. `owner`: name of the object
/// or the list that has it; empty: the root.
bool belongsTo(const std::string& extension, const std::string& owner) {
    if (extension == "KHR_materials_variants")
        return owner.empty() || owner == "primitives";
    if (extension.starts_with("KHR_materials_"))
        return owner == "materials";
    if (extension == "KHR_lights_punctual")
        return owner.empty() || owner == "nodes";
    if (extension == "KHR_texture_transform")
        return owner.ends_with("Texture");
    if (extension == "EXT_mesh_gpu_instancing")
        return owner == "nodes";
    if (extension == "KHR_mesh_quantization")
        return false; // it has no objects
    return true;
}

/// Walks all objects.
class Walker {
  public:
    Walker(const json& root, Deviations& out) : m_root(root), m_out(out) {
        const json& required = listIn(root, "extensionsRequired");
        for (const json& name : listIn(root, "extensionsUsed"))
            if (name.is_string() && !m_used.insert(name.get<std::string>()).second)
                add("extensionsUsed", name.get<std::string>() + " occurs twice");
        for (const json& name : required)
            if (name.is_string() && !m_used.count(name.get<std::string>()))
                add("extensionsRequired", name.get<std::string>() + " is not in extensionsUsed");
        if (m_used.count("KHR_mesh_quantization") && !contains(required, "KHR_mesh_quantization"))
            add("extensionsRequired", "KHR_mesh_quantization is missing");
        for (const char* list : {"accessors", "animations", "buffers", "bufferViews", "cameras", "images",
                                 "materials", "meshes", "nodes", "samplers", "scenes", "skins", "textures"})
            if (has(root, list) && !get(root, list).is_array())
                add(list, "must be an array");
    }

    void walk(const json& value, const std::string& path, const std::string& name) {
        if (value.is_array()) {
            if (value.empty())
                add(path, "must not be empty");
            for (size_t i = 0; i < value.size(); ++i)
                if (value[i].is_structured())
                    walk(value[i], path + "[" + std::to_string(i) + "]", name);
            return;
        }
        for (const auto& [member, child] : value.items()) {
            const std::string childPath = path.empty() ? member : path + "." + member;
            if (member == "extras")
                continue;
            if (member == "extensions" && child.is_object())
                checkExtensions(child, childPath, path.empty() ? "" : name);
            checkReference(member, child, childPath, name);
            if (member == "attributes" && child.is_object() && child.empty())
                add(childPath, "must not be empty");
            if (child.is_structured())
                walk(child, childPath, member);
        }
    }

  private:
    void add(const std::string& path, const std::string& message) { m_out.emplace_back(path, message); }
    void checkIndex(const json& index, const char* list, const std::string& path) {
        if (!index.is_number_unsigned())
            return;
        const auto items = m_root.find(list);
        const size_t count = items == m_root.end() ? 0 : items->size();
        if (index.get<uint64_t>() >= count)
            add(path,
                "there is no item " + index.dump() + " in " + list + ", which has " + std::to_string(count));
    }
    void checkReference(const std::string& member, const json& value, const std::string& path,
                        const std::string& parent) {
        if (const char* list = listOf(member, parent))
            checkIndex(value, list, path);
        if (!isNodeList(member, parent) || !value.is_array())
            return;
        std::set<json> seen;
        for (size_t i = 0; i < value.size(); ++i) {
            checkIndex(value[i], "nodes", path + "[" + std::to_string(i) + "]");
            if (!seen.insert(value[i]).second)
                add(path + "[" + std::to_string(i) + "]", "occurs twice");
        }
    }
    void checkExtensions(const json& extensions, const std::string& path, const std::string& owner) {
        for (const auto& [name, value] : extensions.items()) {
            if (!m_used.count(name))
                add(path + "." + name, "is not in extensionsUsed");
            else if (!belongsTo(name, owner))
                add(path + "." + name, "does not belong here");
        }
    }

    const json& m_root;
    Deviations& m_out;
    std::set<std::string> m_used;
};

} // namespace

Deviations findDeviations(const json& root) {
    Deviations out;
    Walker(root, out).walk(root, "", "");
    checkItems(root, out);
    checkLayout(root, out);
    return out;
}

} // namespace strobe::gltf
