#include "gltf/nodes.h"

#include <algorithm>

namespace strobe::gltf {
namespace {

/// Deeper trees are nobody's scenes; paths of moving nodes are as long as the tree is deep.
constexpr int kMaxDepth = 1000;
/// Where a scale factor is 0 this takes its place: matrices stay invertible, and nothing of it can be seen.
constexpr float kMinScale = 1e-7f;

V3f vectorFrom(const Document& document, const std::vector<double>& numbers, const V3f& fallback,
               const std::string& place) {
    if (numbers.empty())
        return fallback;
    if (numbers.size() != 3)
        document.fail(place, "must be three numbers");
    return {float(numbers[0]), float(numbers[1]), float(numbers[2])};
}

float awayFromZero(float x) { return std::abs(x) < kMinScale ? std::copysign(kMinScale, x) : x; }

M44f matrixOf(const V3f& translation, const float* q, const V3f& scale) {
    // Quaternions rotate as v' = q v q*; Imath's matrices act on rows.
    M44f m = Quatf(q[3], q[0], q[1], q[2]).toMatrix44();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            m[i][j] *= awayFromZero(scale[i]);
    for (int j = 0; j < 3; ++j)
        m[3][j] = translation[j];
    return m;
}

} // namespace

NodeTree::NodeTree(const Document& document, const std::string& scene) : m_document(document) {
    const tinygltf::Model& model = document.model();
    m_visited.resize(model.nodes.size());
    findParents();
    for (size_t i = 0; i < model.nodes.size(); ++i)
        m_poses.push_back(poseOf(i));
    for (size_t i = 0; i < model.nodes.size(); ++i)
        if (m_parents[i] < 0)
            visit(int(i), item("nodes", i));
    for (size_t i = 0; i < model.nodes.size(); ++i)
        if (!m_visited[i])
            document.fail(item("nodes", i), "is below itself: the nodes go round in a circle");
    m_all.swap(m_order);
    m_visited.assign(model.nodes.size(), false);

    int chosen = model.defaultScene;
    if (!scene.empty()) {
        for (chosen = 0; size_t(chosen) < model.scenes.size() && model.scenes[size_t(chosen)].name != scene;)
            ++chosen;
        if (size_t(chosen) == model.scenes.size())
            document.fail("scenes", "there is no scene \"" + scene + "\"");
    }
    if (chosen < 0 && model.scenes.empty()) {
        m_order = m_all;
        return;
    }
    chosen = std::max(chosen, 0);
    const auto& roots = document.at(model.scenes, chosen, "scene", "scene").nodes;
    for (size_t i = 0; i < roots.size(); ++i)
        visit(roots[i], item("scenes", size_t(chosen)) + "." + item("nodes", i));
}

void NodeTree::findParents() {
    const auto& nodes = m_document.model().nodes;
    m_parents.assign(nodes.size(), -1);
    for (size_t i = 0; i < nodes.size(); ++i)
        for (size_t k = 0; k < nodes[i].children.size(); ++k) {
            const std::string place = item("nodes", i) + "." + item("children", k);
            const int child = nodes[i].children[k];
            m_document.at(nodes, child, "node", place);
            if (m_parents[size_t(child)] >= 0)
                m_document.fail(place, "node " + std::to_string(child) + " is a child of node " +
                                           std::to_string(m_parents[size_t(child)]) + " already");
            m_parents[size_t(child)] = int(i);
        }
}

/// Appends a node and all below it to m_order.
void NodeTree::visit(int root, const std::string& place) {
    const auto& nodes = m_document.model().nodes;
    m_document.at(nodes, root, "node", place);
    std::vector<std::pair<size_t, int>> open{{size_t(root), 0}}; // with depth
    while (!open.empty()) {
        const auto [node, depth] = open.back();
        open.pop_back();
        if (m_visited[node])
            m_document.fail(place, "node " + std::to_string(node) + " is in the scene twice");
        if (depth > kMaxDepth)
            m_document.fail(item("nodes", node),
                            "is more than " + std::to_string(kMaxDepth) + " levels below the root");
        m_visited[node] = true;
        m_order.push_back(node);
        const auto& children = nodes[node].children;
        for (auto it = children.rbegin(); it != children.rend(); ++it)
            open.emplace_back(size_t(*it), depth + 1);
    }
}

NodeTree::Pose NodeTree::poseOf(size_t index) const {
    const tinygltf::Node& node = m_document.model().nodes[index];
    const std::string place = item("nodes", index);
    Pose pose;
    pose.translation = vectorFrom(m_document, node.translation, V3f(0), place + ".translation");
    pose.scale = vectorFrom(m_document, node.scale, V3f(1), place + ".scale");
    if (!node.rotation.empty()) {
        if (node.rotation.size() != 4)
            m_document.fail(place + ".rotation", "must be four numbers");
        double l2 = 0;
        for (const double x : node.rotation)
            l2 += x * x;
        if (!(l2 > 1e-12))
            m_document.fail(place + ".rotation", "is not a unit quaternion");
        for (size_t k = 0; k < 4; ++k)
            pose.rotation[k] = float(node.rotation[k] / std::sqrt(l2));
    }
    if (!node.matrix.empty()) {
        if (node.matrix.size() != 16)
            m_document.fail(place + ".matrix", "must be sixteen numbers");
        for (int i = 0; i < 16; ++i)
            pose.matrix[i / 4][i % 4] = float(node.matrix[size_t(i)]); // columns there, rows here
        if (pose.matrix[0][3] != 0 || pose.matrix[1][3] != 0 || pose.matrix[2][3] != 0 ||
            pose.matrix[3][3] != 1)
            m_document.fail(place + ".matrix", "is not affine");
        pose.isMatrix = true;
    }
    return pose;
}

M44f NodeTree::local(size_t node, const Clip& clip, float time) const {
    Pose pose = m_poses[node];
    const NodeCurves& curves = clip.of(node);
    if (pose.isMatrix && !curves.moves())
        return pose.matrix;
    if (curves.translation)
        curves.translation->at(time, &pose.translation.x);
    if (curves.rotation)
        curves.rotation->at(time, pose.rotation);
    if (curves.scale)
        curves.scale->at(time, &pose.scale.x);
    return matrixOf(pose.translation, pose.rotation, pose.scale);
}

std::vector<M44f> NodeTree::globals(const Clip& clip, float time) const {
    std::vector<M44f> out(m_parents.size());
    for (const size_t node : m_all) {
        out[node] = local(node, clip, time);
        if (const int parent = m_parents[node]; parent >= 0)
            out[node] = out[node] * out[size_t(parent)];
    }
    return out;
}

bool NodeTree::moves(size_t node, const Clip& clip) const {
    for (int at = int(node); at >= 0; at = m_parents[size_t(at)])
        if (clip.of(size_t(at)).moves())
            return true;
    return false;
}

namespace {

/// True when interpolating between transforms `a` and `b`, at fraction t, comes close enough to `truth`.
bool isClose(const Decomposed& a, const Decomposed& b, float t, const Decomposed& truth,
             const MotionTolerance& tolerance) {
    const Decomposed guess = interpolate(a, b, t);
    const float rounding = 1e-6f * length(truth.translation);
    if (length(guess.translation - truth.translation) > tolerance.distance + rounding)
        return false;
    // The sine of half the angle between the rotations is the length of the difference's vector part.
    const Quatf difference = guess.rotation * truth.rotation.inverse();
    if (2 * length(difference.v) > tolerance.relative)
        return false;
    float error = 0, size = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            error = std::max(error, std::abs(guess.stretch[i][j] - truth.stretch[i][j]));
            size = std::max(size, std::abs(truth.stretch[i][j]));
        }
    return error <= tolerance.relative * size;
}

/// Samples of a transform at times between which interpolation is close enough.
template <class At>
KeyedTransform sampled(const At& at, std::vector<float> breaks, const Shutter& shutter,
                       const MotionTolerance& tolerance) {
    if (!(shutter.close > shutter.open))
        return KeyedTransform(at(shutter.open));
    breaks.insert(breaks.begin(), shutter.open);
    breaks.push_back(shutter.close);
    constexpr int kMaxHalvings = 10;
    constexpr size_t kManyKeys = 1 << 16; // more than any shutter shows
    std::vector<float> times;
    std::vector<M44f> keys;
    const auto add = [&](float time, const M44f& m) { times.push_back(time), keys.push_back(m); };
    struct Piece {
        float from, to;
        int halvings;
    };
    add(breaks[0], at(breaks[0]));
    for (size_t i = 0; i + 1 < breaks.size(); ++i) {
        std::vector<Piece> open{{breaks[i], breaks[i + 1], 0}};
        while (!open.empty()) {
            const Piece piece = open.back();
            open.pop_back();
            const Decomposed a = decompose(at(piece.from)), b = decompose(at(piece.to));
            const auto close = [&](float t) {
                return isClose(a, b, t, decompose(at(lerp(piece.from, piece.to, t))), tolerance);
            };
            const float middle = lerp(piece.from, piece.to, .5f);
            const bool canHalve = piece.halvings < kMaxHalvings && times.size() < kManyKeys &&
                                  middle > piece.from && middle < piece.to;
            if (!canHalve || (close(.25f) && close(.5f) && close(.75f))) {
                add(piece.to, at(piece.to));
            } else {
                open.push_back({middle, piece.to, piece.halvings + 1});
                open.push_back({piece.from, middle, piece.halvings + 1});
            }
        }
    }
    return KeyedTransform(std::move(times), std::move(keys), MotionConvention::ObjectToWorld);
}

} // namespace

KeyedTransform localMotion(const NodeTree& tree, const Clip& clip, size_t node, const Shutter& shutter,
                           const MotionTolerance& tolerance) {
    const NodeCurves& curves = clip.of(node);
    if (!curves.moves())
        return KeyedTransform(tree.local(node, clip, shutter.open));
    std::vector<float> breaks;
    appendBreaks(curves, shutter.open, shutter.close, breaks);
    return sampled([&](float time) { return tree.local(node, clip, time); }, std::move(breaks), shutter,
                   tolerance);
}

std::vector<TransformChain> motionPaths(const NodeTree& tree, const Clip& clip, const Shutter& shutter,
                                        float sceneSize) {
    std::vector<TransformChain> paths(tree.document().model().nodes.size());
    const std::vector<M44f> globals = tree.globals(clip, shutter.open);
    MotionTolerance tolerance;
    for (const size_t node : tree.order()) {
        const int parent = tree.parent(node);
        const float scale = parent < 0 ? 1.f : std::cbrt(std::abs(determinant3(globals[size_t(parent)])));
        tolerance.distance = tolerance.relative * sceneSize / std::max(scale, 1e-20f);
        paths[node].append(localMotion(tree, clip, node, shutter, tolerance));
        if (parent >= 0)
            for (const KeyedTransform& t : paths[size_t(parent)].chain())
                paths[node].append(t);
    }
    return paths;
}

KeyedTransform flattened(const TransformChain& path, const Shutter& shutter,
                         const MotionTolerance& tolerance) {
    if (path.isStatic())
        return KeyedTransform(path.at(shutter.open));
    if (path.chain().size() == 1)
        return path.chain().front();
    std::vector<float> breaks;
    for (const KeyedTransform& t : path.chain())
        for (const float time : t.times())
            if (time > shutter.open && time < shutter.close)
                breaks.push_back(time);
    std::sort(breaks.begin(), breaks.end());
    breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
    return sampled([&](float time) { return path.at(time); }, std::move(breaks), shutter, tolerance);
}

} // namespace strobe::gltf
