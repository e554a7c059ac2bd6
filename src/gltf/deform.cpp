#include "gltf/deform.h"

#include "gltf/file/accessor.h"

#include <algorithm>

namespace strobe::gltf {
namespace {

constexpr size_t kMaxSteps = 128;    // Embree's limit
constexpr double kMaxKeyBytes = 2e9; // of the keys of one mesh

/// Returns the largest distance between vertices of the same index.
float largestDistance(const std::vector<V3f>& a, const std::vector<V3f>& b) {
    float largest2 = 0;
    for (size_t i = 0; i < a.size(); ++i)
        largest2 = std::max(largest2, length2(a[i] - b[i]));
    return std::sqrt(largest2);
}

/// Returns the largest distance of vertices interpolated between `a` and `b`, at fraction t, from `truth`.
float largestDistance(const std::vector<V3f>& a, const std::vector<V3f>& b, float t,
                      const std::vector<V3f>& truth) {
    float largest2 = 0;
    for (size_t i = 0; i < a.size(); ++i)
        largest2 = std::max(largest2, length2(lerp(a[i], b[i], t) - truth[i]));
    return std::sqrt(largest2);
}

/// Returns the diagonal of the bounds.
float sizeOf(const std::vector<V3f>& points) {
    Box3f box;
    for (const V3f& p : points)
        box.extendBy(p);
    return box.isEmpty() ? 0 : length(box.size());
}

std::vector<float> floatsOf(const std::vector<double>& numbers) { return {numbers.begin(), numbers.end()}; }

/// Returns a normal transformed by `m`, by means of the cofactors of its linear part, which need no inverse.
V3f transformNormalByCofactors(const M44f& m, const V3f& n) {
    const V3f x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]);
    const V3f yz = cross(y, z);
    const float sign = dot(x, yz) < 0 ? -1.f : 1.f;
    return normalize(yz * n.x + cross(z, x) * n.y + cross(x, y) * n.z) * sign;
}

} // namespace

Skin readSkin(const Document& document, int index, const std::string& jsonPath) {
    const tinygltf::Skin& source = document.at(document.model().skins, index, "skin", jsonPath);
    const std::string skinPath = item("skins", size_t(index));
    Skin skin;
    for (size_t i = 0; i < source.joints.size(); ++i) {
        document.at(document.model().nodes, source.joints[i], "node", skinPath + "." + item("joints", i));
        skin.joints.push_back(size_t(source.joints[i]));
    }
    if (skin.joints.empty())
        document.fail(skinPath + ".joints", "must not be empty");
    if (source.inverseBindMatrices >= 0)
        skin.inverseBind =
            readM44f(document, source.inverseBindMatrices, skinPath + ".inverseBindMatrices", {});
    else
        skin.inverseBind.assign(skin.joints.size(), M44f());
    if (skin.inverseBind.size() < skin.joints.size())
        document.fail(skinPath + ".inverseBindMatrices", std::to_string(skin.inverseBind.size()) +
                                                             " matrices for " +
                                                             std::to_string(skin.joints.size()) + " joints");
    return skin;
}

Deformer::Deformer(const NodeTree& tree, const Clip& clip, const Primitive& primitive, size_t node,
                   const Skin* skin)
    : m_tree(tree), m_clip(clip), m_primitive(primitive), m_node(node),
      m_skin(skin && primitive.skin.perVertex > 0 ? skin : nullptr) {
    const tinygltf::Model& model = tree.document().model();
    const tinygltf::Node& source = model.nodes[node];
    const std::vector<double>& meshWeights = model.meshes[size_t(source.mesh)].weights;
    m_weights = floatsOf(source.weights.empty() ? meshWeights : source.weights);
    const size_t targets = primitive.targets.size();
    if (m_weights.size() > targets)
        tree.document().fail(item("nodes", node) + ".weights", std::to_string(m_weights.size()) +
                                                                   " weights for " + std::to_string(targets) +
                                                                   " morph targets");
    m_weights.resize(targets);
    const bool allZero = std::all_of(m_weights.begin(), m_weights.end(), [](float w) { return w == 0; });
    m_morphs = targets > 0 && (clip.curves(node).weights || !allZero);
    if (m_skin)
        for (const uint32_t joint : primitive.skin.joints)
            if (joint >= skin->joints.size())
                tree.document().fail(primitive.jsonPath + ".attributes.JOINTS_0",
                                     "joint " + std::to_string(joint) + " is out of range: the skin has " +
                                         std::to_string(skin->joints.size()) + " joints");
}

std::vector<float> Deformer::weightsAt(float time) const {
    std::vector<float> weights = m_weights;
    if (const auto& curve = m_clip.curves(m_node).weights)
        curve->evaluate(time, weights.data());
    return weights;
}

void Deformer::morph(Key& key, float time) const {
    const std::vector<float> weights = weightsAt(time);
    for (size_t t = 0; t < weights.size(); ++t) {
        const MorphTarget& target = m_primitive.targets[t];
        if (weights[t] == 0)
            continue;
        for (size_t i = 0; i < target.positions.size(); ++i)
            key.positions[i] += target.positions[i] * weights[t];
        for (size_t i = 0; i < key.normals.size() && i < target.normals.size(); ++i)
            key.normals[i] += target.normals[i] * weights[t];
    }
}

void Deformer::skin(Key& key, float time) const {
    const std::vector<M44f> globals = m_tree.globals(m_clip, time);
    std::vector<M44f> joints;
    for (size_t j = 0; j < m_skin->joints.size(); ++j)
        joints.push_back(m_skin->inverseBind[j] * globals[m_skin->joints[j]]);
    const SkinWeights& weights = m_primitive.skin;
    for (size_t v = 0; v < key.positions.size(); ++v) {
        M44f blend(0.f);
        for (size_t k = v * weights.perVertex; k < (v + 1) * weights.perVertex; ++k)
            if (weights.weights[k] > 0)
                blend += joints[weights.joints[k]] * weights.weights[k];
        key.positions[v] = transformPoint(blend, key.positions[v]);
        if (!key.normals.empty())
            key.normals[v] = transformNormalByCofactors(blend, key.normals[v]);
    }
}

Deformer::Key Deformer::keyAt(float time) const {
    const TriangleMesh& mesh = m_primitive.mesh;
    Key key{mesh.positions[0], mesh.normals.empty() ? std::vector<V3f>{} : mesh.normals[0]};
    if (m_morphs)
        morph(key, time);
    if (m_skin)
        skin(key, time);
    for (const V3f& p : key.positions)
        if (!std::isfinite(p.x + p.y + p.z))
            m_tree.document().fail(m_primitive.jsonPath, "deformed positions are not finite");
    return key;
}

bool Deformer::changes(const Shutter& shutter) const {
    if (!(shutter.close > shutter.open))
        return false;
    if (m_morphs && m_clip.curves(m_node).weights)
        return true;
    return m_skin && std::any_of(m_skin->joints.begin(), m_skin->joints.end(),
                                 [&](size_t joint) { return m_tree.moves(joint, m_clip); });
}

/// Returns true if interpolation between the keys is within the tolerance at the quarters of each step.
/// Stores the quarters, three for each step, in `quarters`.
bool Deformer::isClose(const std::vector<Key>& keys, const Shutter& shutter, float tolerance,
                       std::vector<Key>& quarters) const {
    quarters.clear();
    const size_t steps = keys.size() - 1;
    bool isWithin = true;
    for (size_t i = 0; i < steps; ++i)
        for (int q = 1; q <= 3; ++q) {
            const float t = float(q) / 4;
            quarters.push_back(keyAt(shutter.sceneTime((float(i) + t) / float(steps))));
            isWithin &= largestDistance(keys[i].positions, keys[i + 1].positions, t,
                                        quarters.back().positions) <= tolerance;
        }
    return isWithin;
}

/// Returns keys over the shutter: one if nothing changes, else a power of two of steps.
std::vector<Deformer::Key> Deformer::keysDuring(const Shutter& shutter, float relativeTolerance,
                                                Diagnostics& diagnostics) const {
    std::vector<Key> keys{keyAt(shutter.open)};
    std::vector<Key> quarters;
    if (!changes(shutter))
        return keys;
    keys.push_back(keyAt(shutter.close));
    const float size = sizeOf(keys[0].positions);
    for (size_t steps = 1; !isClose(keys, shutter, relativeTolerance * size, quarters); steps *= 2) {
        const double finerBytes = 8. * double(steps) * double(keys[0].positions.size()) * 2 * sizeof(V3f);
        if (2 * steps > kMaxSteps || finerBytes > kMaxKeyBytes) {
            m_tree.document().warnOnce(
                diagnostics, "deformation", m_primitive.jsonPath,
                "deforms too much during the shutter for the tolerance; it is approximated "
                "by " +
                    std::to_string(steps) + " steps");
            return keys;
        }
        std::vector<Key> finer; // the middle quarters become keys
        for (size_t i = 0; i < steps; ++i) {
            finer.push_back(std::move(keys[i]));
            finer.push_back(std::move(quarters[3 * i + 1]));
        }
        finer.push_back(std::move(keys.back()));
        keys = std::move(finer);
    }
    const auto isAtStart = [&](const Key& key) {
        return largestDistance(keys[0].positions, key.positions) <= 1e-7f * size;
    };
    if (keys.size() == 2 && isAtStart(keys[1]) && std::all_of(quarters.begin(), quarters.end(), isAtStart))
        keys.resize(1);
    return keys;
}

TriangleMesh Deformer::meshDuring(const Shutter& shutter, float relativeTolerance,
                                  Diagnostics& diagnostics) const {
    std::vector<Key> keys = keysDuring(shutter, relativeTolerance, diagnostics);
    const TriangleMesh& source = m_primitive.mesh;
    TriangleMesh mesh; // without tangents: shading derives them from texture coordinates
    mesh.indices = source.indices;
    mesh.uvs = source.uvs;
    mesh.alpha = source.alpha;
    mesh.culledSide = source.culledSide;
    const size_t count = keys.size();
    for (size_t i = 0; i < count; ++i) {
        mesh.positions.push_back(std::move(keys[i].positions));
        if (!keys[i].normals.empty())
            mesh.normals.push_back(std::move(keys[i].normals));
        if (count > 1)
            mesh.keyTimes.push_back(shutter.sceneTime(float(i) / float(count - 1)));
    }
    return mesh;
}

} // namespace strobe::gltf
