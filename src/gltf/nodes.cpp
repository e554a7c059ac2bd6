#include "gltf/nodes.h"

#include <algorithm>

namespace strobe::gltf {
namespace {

constexpr int kMaxDepth = 1000; // bounds the length of the transform chains of moving nodes
/// Replaces scale factors of 0, so that matrices stay invertible. Shapes of that scale are invisible.
constexpr float kMinScale = 1e-7f;
constexpr int kMaxHalvings = 10;
constexpr size_t kMaxKeys = 1 << 16;

V3f vectorFrom(const Document& document, const std::vector<double>& numbers, const V3f& fallback,
               const std::string& jsonPath) {
    if (numbers.empty())
        return fallback;
    if (numbers.size() != 3)
        document.fail(jsonPath, "must be three numbers");
    return {float(numbers[0]), float(numbers[1]), float(numbers[2])};
}

float clampScale(float x) { return std::abs(x) < kMinScale ? std::copysign(kMinScale, x) : x; }

} // namespace

M44f matrixOf(const V3f& translation, const float* q, const V3f& scale) {
    // Imath's matrices transform row vectors; glTF's quaternions rotate v to q v q*.
    M44f m = Quatf(q[3], q[0], q[1], q[2]).toMatrix44();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            m[i][j] *= clampScale(scale[i]);
    for (int j = 0; j < 3; ++j)
        m[3][j] = translation[j];
    return m;
}

NodeTree::NodeTree(const Document& document, const std::string& scene) : m_document(document) {
    findParents();
    for (size_t i = 0; i < document.model().nodes.size(); ++i)
        m_poses.push_back(poseOf(i));
    findAllNodes();
    findSceneNodes(scene);
}

/// Fills m_all. Throws if the nodes have a cycle.
void NodeTree::findAllNodes() {
    const size_t count = m_document.model().nodes.size();
    m_visited.assign(count, false);
    for (size_t i = 0; i < count; ++i)
        if (m_parents[i] < 0)
            visit(int(i), item("nodes", i));
    for (size_t i = 0; i < count; ++i)
        if (!m_visited[i])
            m_document.fail(item("nodes", i), "is part of a cycle of nodes");
    m_all.swap(m_order);
}

/// Fills m_order.
void NodeTree::findSceneNodes(const std::string& scene) {
    const tinygltf::Model& model = m_document.model();
    int chosen = model.defaultScene;
    if (!scene.empty()) {
        const auto found = std::find_if(model.scenes.begin(), model.scenes.end(),
                                        [&](const tinygltf::Scene& s) { return s.name == scene; });
        if (found == model.scenes.end())
            m_document.fail("scenes", "there is no scene \"" + scene + "\"");
        chosen = int(found - model.scenes.begin());
    }
    if (chosen < 0 && model.scenes.empty()) {
        m_order = m_all;
        return;
    }
    chosen = std::max(chosen, 0);
    m_visited.assign(model.nodes.size(), false);
    const auto& roots = m_document.at(model.scenes, chosen, "scene", "scene").nodes;
    for (size_t i = 0; i < roots.size(); ++i)
        visit(roots[i], item("scenes", size_t(chosen)) + "." + item("nodes", i));
}

void NodeTree::findParents() {
    const auto& nodes = m_document.model().nodes;
    m_parents.assign(nodes.size(), -1);
    for (size_t i = 0; i < nodes.size(); ++i)
        for (size_t k = 0; k < nodes[i].children.size(); ++k) {
            const std::string jsonPath = item("nodes", i) + "." + item("children", k);
            const int child = nodes[i].children[k];
            m_document.at(nodes, child, "node", jsonPath);
            if (m_parents[size_t(child)] >= 0)
                m_document.fail(jsonPath, "node " + std::to_string(child) + " is already a child of node " +
                                              std::to_string(m_parents[size_t(child)]));
            m_parents[size_t(child)] = int(i);
        }
}

/// Appends a node and its descendants to m_order.
void NodeTree::visit(int root, const std::string& jsonPath) {
    const auto& nodes = m_document.model().nodes;
    m_document.at(nodes, root, "node", jsonPath);
    std::vector<std::pair<size_t, int>> stack{{size_t(root), 0}}; // nodes and their depths
    while (!stack.empty()) {
        const auto [node, depth] = stack.back();
        stack.pop_back();
        if (m_visited[node])
            m_document.fail(jsonPath, "node " + std::to_string(node) + " is in the scene twice");
        if (depth > kMaxDepth)
            m_document.fail(item("nodes", node),
                            "is more than " + std::to_string(kMaxDepth) + " levels deep");
        m_visited[node] = true;
        m_order.push_back(node);
        const auto& children = nodes[node].children;
        for (auto it = children.rbegin(); it != children.rend(); ++it)
            stack.emplace_back(size_t(*it), depth + 1);
    }
}

NodeTree::Pose NodeTree::poseOf(size_t index) const {
    const tinygltf::Node& node = m_document.model().nodes[index];
    const std::string jsonPath = item("nodes", index);
    Pose pose;
    pose.translation = vectorFrom(m_document, node.translation, V3f(0), jsonPath + ".translation");
    pose.scale = vectorFrom(m_document, node.scale, V3f(1), jsonPath + ".scale");
    if (!node.rotation.empty()) {
        if (node.rotation.size() != 4)
            m_document.fail(jsonPath + ".rotation", "must be four numbers");
        double l2 = 0;
        for (const double x : node.rotation)
            l2 += x * x;
        if (!(l2 > 1e-12))
            m_document.fail(jsonPath + ".rotation", "is not a unit quaternion");
        for (size_t k = 0; k < 4; ++k)
            pose.rotation[k] = float(node.rotation[k] / std::sqrt(l2));
    }
    if (!node.matrix.empty()) {
        if (node.matrix.size() != 16)
            m_document.fail(jsonPath + ".matrix", "must be sixteen numbers");
        for (int i = 0; i < 16; ++i)
            pose.matrix[i / 4][i % 4] = float(node.matrix[size_t(i)]); // glTF's columns are Imath's rows
        if (pose.matrix[0][3] != 0 || pose.matrix[1][3] != 0 || pose.matrix[2][3] != 0 ||
            pose.matrix[3][3] != 1)
            m_document.fail(jsonPath + ".matrix", "is not affine");
        pose.isMatrix = true;
    }
    return pose;
}

M44f NodeTree::local(size_t node, const Clip& clip, float time) const {
    Pose pose = m_poses[node];
    const NodeCurves& curves = clip.curves(node);
    if (pose.isMatrix && !curves.moves())
        return pose.matrix;
    if (curves.translation)
        curves.translation->evaluate(time, &pose.translation.x);
    if (curves.rotation)
        curves.rotation->evaluate(time, pose.rotation);
    if (curves.scale)
        curves.scale->evaluate(time, &pose.scale.x);
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
    for (int ancestor = int(node); ancestor >= 0; ancestor = m_parents[size_t(ancestor)])
        if (clip.curves(size_t(ancestor)).moves())
            return true;
    return false;
}

namespace {

/// Returns true if the interpolation of `a` and `b` at fraction t is within the tolerance of `truth`.
bool isClose(const Decomposed& a, const Decomposed& b, float t, const Decomposed& truth,
             const MotionTolerance& tolerance) {
    const Decomposed interpolated = interpolate(a, b, t);
    const float rounding = 1e-6f * length(truth.translation);
    if (length(interpolated.translation - truth.translation) > tolerance.distance + rounding)
        return false;
    // The length of the vector part is the sine of half the angle between the rotations.
    const Quatf difference = interpolated.rotation * truth.rotation.inverse();
    if (2 * length(difference.v) > tolerance.relative)
        return false;
    float error = 0;
    float size = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            error = std::max(error, std::abs(interpolated.stretch[i][j] - truth.stretch[i][j]));
            size = std::max(size, std::abs(truth.stretch[i][j]));
        }
    return error <= tolerance.relative * size;
}

/// Samples a transform, `evaluate(time)`, over the shutter: intervals between the breaks are halved until
/// interpolation is within the tolerance at their quarters.
template <class Evaluate>
class MotionSampler {
  public:
    MotionSampler(const Evaluate& evaluate, const MotionTolerance& tolerance)
        : m_evaluate(evaluate), m_tolerance(tolerance) {}

    /// `breaks`: ascending times inside the shutter where the transform may have corners.
    KeyedTransform sample(std::vector<float> breaks, const Shutter& shutter) {
        if (!(shutter.close > shutter.open))
            return KeyedTransform(m_evaluate(shutter.open));
        breaks.insert(breaks.begin(), shutter.open);
        breaks.push_back(shutter.close);
        addKey(breaks[0]);
        for (size_t i = 0; i + 1 < breaks.size(); ++i)
            sampleInterval(breaks[i], breaks[i + 1]);
        return KeyedTransform(std::move(m_times), std::move(m_keys), MotionConvention::ObjectToWorld);
    }

  private:
    struct Interval {
        float begin, end;
        int halvings;
    };

    void addKey(float time) {
        m_times.push_back(time);
        m_keys.push_back(m_evaluate(time));
    }

    /// Adds the keys in (begin, end].
    void sampleInterval(float begin, float end) {
        std::vector<Interval> stack{{begin, end, 0}};
        while (!stack.empty()) {
            const Interval interval = stack.back();
            stack.pop_back();
            const float middle = lerp(interval.begin, interval.end, .5f);
            const bool canHalve = interval.halvings < kMaxHalvings && m_times.size() < kMaxKeys &&
                                  middle > interval.begin && middle < interval.end;
            if (!canHalve || isWithinTolerance(interval)) {
                addKey(interval.end);
            } else {
                stack.push_back({middle, interval.end, interval.halvings + 1});
                stack.push_back({interval.begin, middle, interval.halvings + 1});
            }
        }
    }

    bool isWithinTolerance(const Interval& interval) const {
        const Decomposed a = decompose(m_evaluate(interval.begin));
        const Decomposed b = decompose(m_evaluate(interval.end));
        const auto isCloseAt = [&](float t) {
            const Decomposed truth = decompose(m_evaluate(lerp(interval.begin, interval.end, t)));
            return isClose(a, b, t, truth, m_tolerance);
        };
        return isCloseAt(.25f) && isCloseAt(.5f) && isCloseAt(.75f);
    }

    const Evaluate& m_evaluate;
    const MotionTolerance m_tolerance;
    std::vector<float> m_times;
    std::vector<M44f> m_keys;
};

} // namespace

KeyedTransform localMotion(const NodeTree& tree, const Clip& clip, size_t node, const Shutter& shutter,
                           const MotionTolerance& tolerance) {
    const NodeCurves& curves = clip.curves(node);
    if (!curves.moves())
        return KeyedTransform(tree.local(node, clip, shutter.open));
    std::vector<float> breaks;
    appendBreaks(curves, shutter.open, shutter.close, breaks);
    const auto evaluate = [&](float time) { return tree.local(node, clip, time); };
    return MotionSampler(evaluate, tolerance).sample(std::move(breaks), shutter);
}

std::vector<TransformChain> motionPaths(const NodeTree& tree, const Clip& clip, const Shutter& shutter,
                                        float sceneSize) {
    std::vector<TransformChain> paths(tree.document().model().nodes.size());
    const std::vector<M44f> globals = tree.globals(clip, shutter.open);
    MotionTolerance tolerance;
    for (const size_t node : tree.order()) {
        const int parent = tree.parent(node);
        // The ancestors scale the errors of a node.
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
    const auto evaluate = [&](float time) { return path.at(time); };
    return MotionSampler(evaluate, tolerance).sample(std::move(breaks), shutter);
}

} // namespace strobe::gltf
