#include "gltf/file/json_repair.h"

#include "gltf/file/json_access.h"

#include <cmath>

namespace strobe::gltf {
namespace {

class Repairer {
  public:
    Repairer(json& root, bool (*isInteger)(const std::string&)) : m_root(root), m_isInteger(isInteger) {}

    JsonRepair run() {
        makeIntegers(m_root, "", false);
        if (m_root.contains("accessors") && m_root["accessors"].is_array())
            repairTypes();
        for (const json& mesh : listIn(m_root, "meshes"))
            for (const json& primitive : listIn(mesh, "primitives"))
                addUnbacked(get(primitive, "indices"));
        backIndices();
        return std::move(m_out);
    }

  private:
    /// `name`: of the value, or of the array that has it. `isIndex`: the value or its elements are integers.
    void makeIntegers(json& value, const std::string& name, bool isIndex) {
        if (isIndex && value.is_number_float()) {
            const double number = value.get<double>();
            if (number >= 0 && number < 0x1p53 && number == std::floor(number)) {
                value = uint64_t(number);
                m_out.isChanged = true;
            }
        }
        if (value.is_array())
            for (json& element : value)
                makeIntegers(element, name, isIndex);
        const bool hasAccessors = name == "attributes" || name == "targets";
        if (value.is_object())
            for (auto& [member, content] : value.items())
                if (member != "extras")
                    makeIntegers(content, member, hasAccessors || m_isInteger(member));
    }

    void repairTypes() {
        static const json known{"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
        json& accessors = m_root["accessors"];
        for (size_t i = 0; i < accessors.size(); ++i) {
            const json type = get(accessors[i], "type");
            if (!type.is_string() || contains(known, type.get<std::string>()))
                continue;
            m_out.deviations.emplace_back("accessors[" + std::to_string(i) + "].type",
                                          type.dump() + " is not a type; it is read as SCALAR");
            accessors[i]["type"] = "SCALAR";
            m_out.isChanged = true;
        }
    }

    void addUnbacked(const json& index) {
        const json& accessor = itemOf(m_root, "accessors", index);
        if (accessor.is_object() && !accessor.contains("bufferView"))
            m_out.unbacked.push_back(index.get<size_t>());
    }
    /// Gives the accessors a buffer view, which is not read.
    void backIndices() {
        if (m_out.unbacked.empty())
            return;
        for (const char* list : {"buffers", "bufferViews"})
            if (!m_root.contains(list))
                m_root[list] = json::array();
        json& buffers = m_root["buffers"];
        json& views = m_root["bufferViews"];
        if (!buffers.is_array() || !views.is_array())
            return;
        if (buffers.empty()) {
            buffers.push_back(json::object());
            replaceBuffer(buffers[0], 1);
        }
        views.push_back({{"buffer", 0u}, {"byteLength", 1u}});
        for (const size_t index : m_out.unbacked)
            m_root["accessors"][index]["bufferView"] = views.size() - 1;
        m_out.isChanged = true;
    }

    json& m_root;
    bool (*const m_isInteger)(const std::string&);
    JsonRepair m_out;
};

} // namespace

JsonRepair repairJson(json& root, bool (*isInteger)(const std::string& member)) {
    return Repairer(root, isInteger).run();
}

void replaceBuffer(json& buffer, size_t bytes) {
    const size_t padding = (3 - bytes % 3) % 3;
    const std::string digits((bytes + 2) / 3 * 4 - padding, 'A');
    buffer = {{"byteLength", bytes},
              {"uri", "data:application/octet-stream;base64," + digits + std::string(padding, '=')}};
}

} // namespace strobe::gltf
