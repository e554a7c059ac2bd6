#include "gltf/instancing.h"

#include "gltf/file/accessor.h"
#include "gltf/nodes.h"

namespace strobe::gltf {
namespace {

/// The attributes of a node's instances.
class InstanceReader {
  public:
    InstanceReader(const Document& document, const tinygltf::Value& attributes, std::string jsonPath)
        : m_document(document), m_attributes(attributes), m_jsonPath(std::move(jsonPath)) {}

    /// Returns the numbers of an attribute; none if it is missing.
    std::vector<float> numbers(const char* name, int components) {
        if (!m_attributes.Has(name))
            return {};
        const std::string jsonPath = m_jsonPath + "." + name;
        if (!m_attributes.Get(name).IsInt())
            m_document.fail(jsonPath, "must be an integer");
        const auto values =
            readFloats(m_document, m_attributes.Get(name).GetNumberAsInt(), components, jsonPath);
        const size_t count = values.size() / size_t(components);
        if (m_count && *m_count != count)
            m_document.fail(jsonPath, "has " + std::to_string(count) +
                                          " elements, but other attributes have " + std::to_string(*m_count));
        m_count = count;
        return values;
    }
    size_t count() const { return m_count.value_or(1); }

  private:
    const Document& m_document;
    const tinygltf::Value& m_attributes;
    std::string m_jsonPath;
    std::optional<size_t> m_count;
};

} // namespace

std::vector<M44f> instanceTransforms(const Document& document, size_t node) {
    const char* name = "EXT_mesh_gpu_instancing";
    const auto& extensions = document.model().nodes[node].extensions;
    const auto extension = extensions.find(name);
    if (extension == extensions.end() || !extension->second.Has("attributes"))
        return {M44f()};
    InstanceReader reader(document, extension->second.Get("attributes"),
                          item("nodes", node) + ".extensions." + name + ".attributes");
    const std::vector<float> translations = reader.numbers("TRANSLATION", 3);
    const std::vector<float> rotations = reader.numbers("ROTATION", 4);
    const std::vector<float> scales = reader.numbers("SCALE", 3);
    std::vector<M44f> out;
    for (size_t i = 0; i < reader.count(); ++i) {
        const auto vectorAt = [&](const std::vector<float>& values, float fallback) {
            return values.empty() ? V3f(fallback) : V3f(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
        };
        Quatf rotation; // the identity
        if (!rotations.empty()) {
            const float* q = &rotations[4 * i];
            rotation = Quatf(q[3], q[0], q[1], q[2]);
            if (!(rotation.length() > 0))
                rotation = Quatf();
            rotation.normalize();
        }
        const float q[4] = {rotation.v.x, rotation.v.y, rotation.v.z, rotation.r};
        out.push_back(matrixOf(vectorAt(translations, 0), q, vectorAt(scales, 1)));
    }
    return out;
}

} // namespace strobe::gltf
