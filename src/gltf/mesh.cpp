#include "gltf/mesh.h"

#include "gltf/file/accessor.h"
#include "gltf/thicken.h"

#include <numeric>

namespace strobe::gltf {
namespace {

/// Returns the segments of LINES, LINE_LOOP or LINE_STRIP.
std::vector<Segment> segmentsOf(int mode, const std::vector<uint32_t>& indices) {
    std::vector<Segment> segments;
    const size_t step = mode == TINYGLTF_MODE_LINE ? 2 : 1;
    for (size_t i = 0; i + 1 < indices.size(); i += step)
        segments.push_back({indices[i], indices[i + 1]});
    if (mode == TINYGLTF_MODE_LINE_LOOP && indices.size() > 2)
        segments.push_back({indices.back(), indices.front()});
    return segments;
}

/// Reads the attributes of one primitive.
class PrimitiveReader {
  public:
    PrimitiveReader(const Document& document, const tinygltf::Primitive& source, std::string jsonPath)
        : m_document(document), m_source(source) {
        m_out.jsonPath = std::move(jsonPath);
        m_out.material = source.material;
    }

    /// Reads the primitive. Returns false if it has no triangles, with a warning if it has points or lines.
    bool read(size_t targetCount, float pointRadius, Diagnostics& diagnostics) {
        const int mode = m_source.mode < 0 ? TINYGLTF_MODE_TRIANGLES : m_source.mode;
        if (mode < 0 || mode > TINYGLTF_MODE_TRIANGLE_FAN)
            fail(".mode", "unknown mode " + std::to_string(mode));
        const bool isThin = mode < TINYGLTF_MODE_TRIANGLES;
        if (isThin && pointRadius == 0) {
            m_document.warnOnce(diagnostics, "points and lines", m_out.jsonPath,
                                "points and lines are skipped; --gltf-points RADIUS shows them");
            return false;
        }
        if (m_out.material >= 0)
            m_document.at(m_document.model().materials, m_out.material, "material",
                          m_out.jsonPath + ".material");
        readVertices(diagnostics);
        if (!isThin) {
            readIndices(mode, diagnostics);
            if (m_out.mesh.indices.empty())
                return false;
        }
        readUvs();
        readColors();
        readTargets(targetCount);
        readSkin(diagnostics);
        if (isThin)
            thickenPrimitive(mode, pointRadius);
        return !m_out.mesh.indices.empty();
    }
    Primitive take() { return std::move(m_out); }

  private:
    [[noreturn]] void fail(const std::string& member, const std::string& message) const {
        m_document.fail(m_out.jsonPath + member, message);
    }
    const int* find(const std::string& name) const {
        const auto it = m_source.attributes.find(name);
        return it == m_source.attributes.end() ? nullptr : &it->second;
    }
    std::string attributePath(const std::string& name) const {
        return m_out.jsonPath + ".attributes." + name;
    }

    void readVertices(Diagnostics& diagnostics) {
        const int* positions = find("POSITION");
        if (!positions)
            fail(".attributes", "POSITION is missing");
        m_out.mesh.positions.push_back(readV3f(m_document, *positions, attributePath("POSITION")));
        m_vertexCount = m_out.mesh.positions[0].size();
        if (const int* normals = find("NORMAL"))
            m_out.mesh.normals.push_back(
                readDirections(m_document, *normals, attributePath("NORMAL"), m_vertexCount, diagnostics));
        // The fourth component is ignored: texture coordinates determine the sign of the bitangent.
        if (const int* tangents = find("TANGENT"))
            m_out.mesh.tangents =
                readDirections(m_document, *tangents, attributePath("TANGENT"), m_vertexCount, diagnostics);
    }

    /// Returns the indices of the file, or 0, 1, 2, … if it has none.
    std::vector<uint32_t> sourceIndices() const {
        std::vector<uint32_t> indices;
        if (m_source.indices < 0) {
            indices.resize(m_vertexCount);
            std::iota(indices.begin(), indices.end(), 0u);
            return indices;
        }
        indices = readIntegers(m_document, m_source.indices, 1, m_out.jsonPath + ".indices");
        for (size_t i = 0; i < indices.size(); ++i)
            if (indices[i] >= m_vertexCount)
                fail(".indices", "index " + std::to_string(indices[i]) + " (number " + std::to_string(i) +
                                     ") is out of range: the primitive has " + std::to_string(m_vertexCount) +
                                     " vertices");
        return indices;
    }

    /// Converts strips and fans to triangles.
    void readIndices(int mode, Diagnostics& diagnostics) {
        const std::vector<uint32_t> indices = sourceIndices();
        if (mode == TINYGLTF_MODE_TRIANGLES && indices.size() % 3 != 0)
            fail("", "the number of indices, " + std::to_string(indices.size()) + ", is not a multiple of 3");
        if (indices.size() < 3)
            m_document.warnOnce(diagnostics, "no triangles", m_out.jsonPath, "has no triangles");
        const size_t count = indices.size() < 3                ? 0
                             : mode == TINYGLTF_MODE_TRIANGLES ? indices.size() / 3
                                                               : indices.size() - 2;
        for (size_t i = 0; i < count; ++i) {
            const size_t odd = i % 2; // the orientation alternates along a strip
            const std::array<size_t, 3> corner =
                mode == TINYGLTF_MODE_TRIANGLES        ? std::array{3 * i, 3 * i + 1, 3 * i + 2}
                : mode == TINYGLTF_MODE_TRIANGLE_STRIP ? std::array{i, i + 1 + odd, i + 2 - odd}
                                                       : std::array{i + 1, i + 2, size_t(0)};
            const uint32_t a = indices[corner[0]];
            const uint32_t b = indices[corner[1]];
            const uint32_t c = indices[corner[2]];
            if (a != b && b != c && c != a) // degenerate triangles connect strips
                m_out.mesh.indices.insert(m_out.mesh.indices.end(), {a, b, c});
        }
    }

    void readUvs() {
        for (int set = 0;; ++set) {
            const std::string name = "TEXCOORD_" + std::to_string(set);
            const int* accessor = find(name);
            if (!accessor)
                return;
            std::vector<V2f> uvs = readV2f(m_document, *accessor, attributePath(name), m_vertexCount);
            for (V2f& uv : uvs)
                uv.y = 1 - uv.y; // glTF: v = 0 at the top
            m_out.uvSets[set] = std::move(uvs);
        }
    }

    void readColors() {
        const int* accessor = find("COLOR_0");
        if (!accessor)
            return;
        const std::string jsonPath = attributePath("COLOR_0");
        const int n = accessorComponents(m_document, *accessor, jsonPath);
        if (n != 3 && n != 4)
            fail(".attributes.COLOR_0", "has " + std::to_string(n) + " components instead of 3 or 4");
        const auto numbers = readFloats(m_document, *accessor, n, jsonPath, m_vertexCount);
        for (size_t i = 0; i < m_vertexCount; ++i) {
            const float* c = &numbers[i * size_t(n)];
            m_out.colors.emplace_back(c[0], c[1], c[2]);
            if (n == 4)
                m_out.opacities.push_back(c[3]);
        }
    }

    void readTargets(size_t targetCount) {
        if (m_source.targets.size() != targetCount)
            fail(".targets", "has " + std::to_string(m_source.targets.size()) +
                                 " morph targets, but the first primitive has " +
                                 std::to_string(targetCount));
        for (size_t i = 0; i < targetCount; ++i) {
            const std::string jsonPath = m_out.jsonPath + "." + item("targets", i);
            const auto readDisplacements = [&](const char* name) {
                const auto it = m_source.targets[i].find(name);
                return it == m_source.targets[i].end()
                           ? std::vector<V3f>{}
                           : readV3f(m_document, it->second, jsonPath + "." + name, m_vertexCount);
            };
            m_out.targets.push_back({readDisplacements("POSITION"), readDisplacements("NORMAL")});
        }
    }

    void readSkin(Diagnostics& diagnostics) {
        std::vector<std::vector<uint32_t>> joints; // by set of JOINTS_n and WEIGHTS_n
        std::vector<std::vector<float>> weights;
        for (int set = 0;; ++set) {
            const std::string jointName = "JOINTS_" + std::to_string(set);
            const std::string weightName = "WEIGHTS_" + std::to_string(set);
            const int* j = find(jointName);
            const int* w = find(weightName);
            if (!j && !w)
                break;
            if (!j || !w)
                fail(".attributes", jointName + " and " + weightName + " must be used together");
            joints.push_back(readIntegers(m_document, *j, 4, attributePath(jointName), m_vertexCount));
            weights.push_back(readFloats(m_document, *w, 4, attributePath(weightName), m_vertexCount));
        }
        normalizeWeights(joints, weights, diagnostics);
    }

    /// Stores joints and weights by vertex, scaled to a sum of 1.
    void normalizeWeights(const std::vector<std::vector<uint32_t>>& joints,
                          const std::vector<std::vector<float>>& weights, Diagnostics& diagnostics) {
        SkinWeights& skin = m_out.skin;
        skin.perVertex = 4 * joints.size();
        bool hasUnweighted = false;
        for (size_t v = 0; v < m_vertexCount && !joints.empty(); ++v) {
            float sum = 0;
            for (const auto& set : weights)
                for (size_t k = 0; k < 4; ++k)
                    sum += std::max(set[4 * v + k], 0.f);
            hasUnweighted |= !(sum > 0);
            for (size_t s = 0; s < joints.size(); ++s)
                for (size_t k = 0; k < 4; ++k) {
                    const float w = sum > 0 ? std::max(weights[s][4 * v + k], 0.f) / sum : s + k == 0;
                    skin.joints.push_back(joints[s][4 * v + k]);
                    skin.weights.push_back(w);
                }
        }
        if (hasUnweighted)
            m_document.warnOnce(diagnostics, "loose vertices", m_out.jsonPath,
                                "vertices without weights are bound to their first joint");
    }

    /// Replaces points and lines by triangles. Each vertex has the attributes of the point that it surrounds.
    void thickenPrimitive(int mode, float radius) {
        std::vector<uint32_t> isolated;
        std::vector<Segment> segments;
        if (mode == TINYGLTF_MODE_POINTS)
            isolated = sourceIndices();
        else
            segments = segmentsOf(mode, sourceIndices());
        constexpr size_t kBytesPerVertex = 100; // with colors and texture coordinates
        resourcePolicyOf(m_document.where())
            .requireMemory(thickVertexCount(isolated.size(), segments.size()) * kBytesPerVertex,
                           std::to_string(isolated.size() + segments.size()) + " spheres and tubes",
                           "skip points and lines", m_document.where());
        ThickSurface surface = thicken(m_out.mesh.positions[0], isolated, segments, radius);
        const auto gather = [&](auto& values, size_t perVertex = 1) {
            if (values.empty())
                return;
            std::remove_reference_t<decltype(values)> gathered;
            gathered.reserve(surface.sources.size() * perVertex);
            for (const uint32_t source : surface.sources) {
                const auto first = values.begin() + std::ptrdiff_t(source * perVertex);
                gathered.insert(gathered.end(), first, first + std::ptrdiff_t(perVertex));
            }
            values = std::move(gathered);
        };
        for (auto& [set, uvs] : m_out.uvSets)
            gather(uvs);
        gather(m_out.colors);
        gather(m_out.opacities);
        for (MorphTarget& target : m_out.targets) {
            gather(target.positions);
            target.normals.clear();
        }
        gather(m_out.skin.joints, m_out.skin.perVertex);
        gather(m_out.skin.weights, m_out.skin.perVertex);
        m_out.mesh.tangents.clear();
        m_out.mesh.positions = {std::move(surface.positions)};
        m_out.mesh.normals = {std::move(surface.normals)};
        m_out.mesh.indices = std::move(surface.indices);
        m_vertexCount = m_out.mesh.positions[0].size();
    }

    const Document& m_document;
    const tinygltf::Primitive& m_source;
    Primitive m_out;
    size_t m_vertexCount = 0;
};

} // namespace

size_t morphTargetCount(const tinygltf::Mesh& mesh) {
    return mesh.primitives.empty() ? 0 : mesh.primitives[0].targets.size();
}

std::vector<Primitive> readMesh(const Document& document, size_t index, float pointRadius,
                                Diagnostics& diagnostics) {
    const tinygltf::Mesh& mesh = document.model().meshes[index];
    std::vector<Primitive> out;
    for (size_t i = 0; i < mesh.primitives.size(); ++i) {
        PrimitiveReader reader(document, mesh.primitives[i],
                               item("meshes", index) + "." + item("primitives", i));
        if (reader.read(morphTargetCount(mesh), pointRadius, diagnostics))
            out.push_back(reader.take());
    }
    return out;
}

} // namespace strobe::gltf
