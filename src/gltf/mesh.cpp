#include "gltf/mesh.h"

#include "gltf/accessor.h"

#include <numeric>

namespace strobe::gltf {
namespace {

/// Reads the attributes of one primitive.
class PrimitiveReader {
  public:
    PrimitiveReader(const Document& document, const tinygltf::Primitive& source, std::string place)
        : m_document(document), m_source(source) {
        m_out.place = std::move(place);
        m_out.material = source.material;
    }

    /// False when it is no triangles.
    bool read(size_t targetCount, Diagnostics& messages) {
        const int mode = m_source.mode < 0 ? TINYGLTF_MODE_TRIANGLES : m_source.mode;
        if (mode < 0 || mode > TINYGLTF_MODE_TRIANGLE_FAN)
            fail(".mode", "unknown mode " + std::to_string(mode));
        if (mode < TINYGLTF_MODE_TRIANGLES) {
            m_document.warnOnce(messages, "points and lines", m_out.place, "points and lines are left out");
            return false;
        }
        if (m_out.material >= 0)
            m_document.at(m_document.model().materials, m_out.material, "material",
                          m_out.place + ".material");
        readVertices();
        readIndices(mode, messages);
        if (m_out.mesh.indices.empty())
            return false;
        readUvs();
        readColors();
        readTargets(targetCount);
        readSkin(messages);
        return true;
    }
    Primitive take() { return std::move(m_out); }

  private:
    [[noreturn]] void fail(const std::string& member, const std::string& message) const {
        m_document.fail(m_out.place + member, message);
    }
    const int* find(const std::string& name) const {
        const auto it = m_source.attributes.find(name);
        return it == m_source.attributes.end() ? nullptr : &it->second;
    }
    std::string placeOf(const std::string& name) const { return m_out.place + ".attributes." + name; }

    void readVertices() {
        const int* positions = find("POSITION");
        if (!positions)
            fail(".attributes", "there is no POSITION");
        m_out.mesh.positions.push_back(readV3f(m_document, *positions, placeOf("POSITION")));
        m_count = m_out.mesh.positions[0].size();
        if (const int* normals = find("NORMAL"))
            m_out.mesh.normals.push_back(readV3f(m_document, *normals, placeOf("NORMAL"), m_count));
        if (const int* tangents = find("TANGENT")) {
            const auto numbers = readFloats(m_document, *tangents, 4, placeOf("TANGENT"), m_count);
            for (size_t i = 0; i < m_count;
                 ++i) // the sign of the bitangent is that of the texture coordinates
                m_out.mesh.tangents.emplace_back(numbers[4 * i], numbers[4 * i + 1], numbers[4 * i + 2]);
        }
    }

    void readIndices(int mode, Diagnostics& messages) {
        std::vector<uint32_t> given;
        if (m_source.indices >= 0) {
            given = readIntegers(m_document, m_source.indices, 1, m_out.place + ".indices");
            for (size_t i = 0; i < given.size(); ++i)
                if (given[i] >= m_count)
                    fail(".indices", "index " + std::to_string(given[i]) + " (number " + std::to_string(i) +
                                         ") of " + std::to_string(m_count) + " vertices");
        } else {
            given.resize(m_count);
            std::iota(given.begin(), given.end(), 0u);
        }
        if (mode == TINYGLTF_MODE_TRIANGLES && given.size() % 3 != 0)
            fail("", std::to_string(given.size()) + " vertices do not make whole triangles");
        if (given.size() < 3)
            m_document.warnOnce(messages, "no triangles", m_out.place, "has no triangles");
        const size_t count = given.size() < 3                  ? 0
                             : mode == TINYGLTF_MODE_TRIANGLES ? given.size() / 3
                                                               : given.size() - 2;
        for (size_t i = 0; i < count; ++i) {
            const size_t odd = i % 2; // strips turn every other triangle
            const std::array<size_t, 3> corner =
                mode == TINYGLTF_MODE_TRIANGLES        ? std::array{3 * i, 3 * i + 1, 3 * i + 2}
                : mode == TINYGLTF_MODE_TRIANGLE_STRIP ? std::array{i, i + 1 + odd, i + 2 - odd}
                                                       : std::array{i + 1, i + 2, size_t(0)};
            const uint32_t a = given[corner[0]], b = given[corner[1]], c = given[corner[2]];
            if (a != b && b != c && c != a) // strips are joined by triangles without area
                m_out.mesh.indices.insert(m_out.mesh.indices.end(), {a, b, c});
        }
    }

    void readUvs() {
        for (int set = 0;; ++set) {
            const std::string name = "TEXCOORD_" + std::to_string(set);
            const int* accessor = find(name);
            if (!accessor)
                return;
            std::vector<V2f> uvs = readV2f(m_document, *accessor, placeOf(name), m_count);
            for (V2f& uv : uvs)
                uv.y = 1 - uv.y; // glTF counts from the top
            m_out.uvSets[set] = std::move(uvs);
        }
    }

    void readColors() {
        const int* accessor = find("COLOR_0");
        if (!accessor)
            return;
        const std::string place = placeOf("COLOR_0");
        const int n = accessorComponents(m_document, *accessor, place);
        if (n != 3 && n != 4)
            fail(".attributes.COLOR_0", "has " + std::to_string(n) + " components instead of 3 or 4");
        const auto numbers = readFloats(m_document, *accessor, n, place, m_count);
        for (size_t i = 0; i < m_count; ++i) {
            const float* c = &numbers[i * size_t(n)];
            m_out.colors.emplace_back(c[0], c[1], c[2]);
            if (n == 4)
                m_out.opacities.push_back(c[3]);
        }
    }

    void readTargets(size_t targetCount) {
        if (m_source.targets.size() != targetCount)
            fail(".targets", std::to_string(m_source.targets.size()) + " morph targets, where the mesh has " +
                                 std::to_string(targetCount));
        for (size_t i = 0; i < targetCount; ++i) {
            const std::string place = m_out.place + "." + item("targets", i);
            const auto readDisplacements = [&](const char* name) {
                const auto it = m_source.targets[i].find(name);
                return it == m_source.targets[i].end()
                           ? std::vector<V3f>{}
                           : readV3f(m_document, it->second, place + "." + name, m_count);
            };
            m_out.targets.push_back({readDisplacements("POSITION"), readDisplacements("NORMAL")});
        }
    }

    void readSkin(Diagnostics& messages) {
        std::vector<std::vector<uint32_t>> joints;
        std::vector<std::vector<float>> weights;
        for (int set = 0;; ++set) {
            const std::string jointName = "JOINTS_" + std::to_string(set),
                              weightName = "WEIGHTS_" + std::to_string(set);
            const int *j = find(jointName), *w = find(weightName);
            if (!j && !w)
                break;
            if (!j || !w)
                fail(".attributes", jointName + " and " + weightName + " go together");
            joints.push_back(readIntegers(m_document, *j, 4, placeOf(jointName), m_count));
            weights.push_back(readFloats(m_document, *w, 4, placeOf(weightName), m_count));
        }
        SkinWeights& skin = m_out.skin;
        skin.perVertex = 4 * joints.size();
        bool someLoose = false;
        for (size_t v = 0; v < m_count && !joints.empty(); ++v) {
            float sum = 0;
            for (const auto& set : weights)
                for (size_t k = 0; k < 4; ++k)
                    sum += std::max(set[4 * v + k], 0.f);
            someLoose |= !(sum > 0);
            for (size_t s = 0; s < joints.size(); ++s)
                for (size_t k = 0; k < 4; ++k) {
                    const float w = sum > 0 ? std::max(weights[s][4 * v + k], 0.f) / sum : s + k == 0;
                    skin.joints.push_back(joints[s][4 * v + k]);
                    skin.weights.push_back(w);
                }
        }
        if (someLoose)
            m_document.warnOnce(messages, "loose vertices", m_out.place,
                                "vertices without weights follow their first joint");
    }

    const Document& m_document;
    const tinygltf::Primitive& m_source;
    Primitive m_out;
    size_t m_count = 0;
};

} // namespace

size_t morphTargetCount(const tinygltf::Mesh& mesh) {
    return mesh.primitives.empty() ? 0 : mesh.primitives[0].targets.size();
}

std::vector<Primitive> readMesh(const Document& document, size_t index, Diagnostics& messages) {
    const tinygltf::Mesh& mesh = document.model().meshes[index];
    std::vector<Primitive> out;
    for (size_t i = 0; i < mesh.primitives.size(); ++i) {
        PrimitiveReader reader(document, mesh.primitives[i],
                               item("meshes", index) + "." + item("primitives", i));
        if (reader.read(morphTargetCount(mesh), messages))
            out.push_back(reader.take());
    }
    return out;
}

} // namespace strobe::gltf
