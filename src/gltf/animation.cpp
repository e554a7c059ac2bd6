#include "gltf/animation.h"

#include "core/util/nearest_name.h"
#include "gltf/file/accessor.h"

#include <algorithm>

namespace strobe::gltf {
namespace {

/// Interpolates unit quaternions along the shorter arc.
void slerp(const float* a, const float* b, float t, float* out) {
    float cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    const float sign = cosine < 0 ? -1.f : 1.f;
    cosine = std::min(std::abs(cosine), 1.f);
    float wa = 1 - t;
    float wb = t;
    if (cosine < 0.9999f) {
        const float angle = std::acos(cosine);
        const float scale = 1 / std::sin(angle);
        wa = std::sin((1 - t) * angle) * scale;
        wb = std::sin(t * angle) * scale;
    }
    for (int k = 0; k < 4; ++k)
        out[k] = wa * a[k] + wb * sign * b[k];
}

/// Normalizes a quaternion; zero becomes the identity.
void normalizeQuaternion(float* q) {
    const float l2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const float scale = l2 > 0 ? 1 / std::sqrt(l2) : 0;
    for (int k = 0; k < 4; ++k)
        q[k] *= scale;
    if (l2 == 0)
        q[3] = 1;
}

Curve::Interpolation interpolationOf(const Document& document, const std::string& name,
                                     const std::string& jsonPath) {
    if (name == "LINEAR" || name.empty())
        return Curve::Interpolation::Linear;
    if (name == "STEP")
        return Curve::Interpolation::Step;
    if (name == "CUBICSPLINE")
        return Curve::Interpolation::CubicSpline;
    document.fail(jsonPath + ".interpolation", "unknown \"" + name + "\" (known: STEP, LINEAR, CUBICSPLINE)");
}

/// Returns the curve that the path of a channel names; null: unknown.
std::shared_ptr<const Curve>* curveOf(NodeCurves& curves, const std::string& path) {
    return path == "translation" ? &curves.translation
           : path == "rotation"  ? &curves.rotation
           : path == "scale"     ? &curves.scale
           : path == "weights"   ? &curves.weights
                                 : nullptr;
}

/// Returns the index of the animation of a name. Throws an Error if there is none.
size_t findAnimation(const Document& document, const std::string& name) {
    const auto& animations = document.model().animations;
    std::vector<std::string> names;
    for (size_t i = 0; i < animations.size(); ++i) {
        if (animations[i].name == name)
            return i;
        names.push_back(animations[i].name);
    }
    std::string message = "there is no animation \"" + name + "\"";
    if (const std::string nearest = nearestName(name, names); !nearest.empty())
        message += "; did you mean \"" + nearest + "\"?";
    std::string list;
    for (const std::string& known : names)
        list += (list.empty() ? "" : ", ") + known;
    document.fail("animations", message + (list.empty() ? "; the file has none" : " (known: " + list + ")"));
}

} // namespace

Curve::Curve(const Document& document, size_t animation, int sampler, int width, bool isRotation,
             Diagnostics& diagnostics)
    : m_width(width), m_isRotation(isRotation) {
    const std::string list = item("animations", animation) + ".samplers";
    const auto& s = document.at(document.model().animations[animation].samplers, sampler, "sampler", list);
    const std::string jsonPath = list + "[" + std::to_string(sampler) + "]";
    m_interpolation = interpolationOf(document, s.interpolation, jsonPath);
    m_times = readFloats(document, s.input, 1, jsonPath + ".input");
    if (m_times.empty())
        document.fail(jsonPath + ".input", "has no keys");
    const size_t keys = m_times.size();
    for (size_t i = 1; i < m_times.size(); ++i)
        if (!(m_times[i] > m_times[i - 1])) {
            document.tolerate(diagnostics, jsonPath, jsonPath + ".input",
                              "times must ascend, but do not at key " + std::to_string(i));
            m_times.resize(i);
        }
    // Weights are stored as scalars, all other values as vectors.
    const int components = accessorComponents(document, s.output, jsonPath + ".output");
    const bool scalars = components == 1 && width != 1;
    const size_t valuesPerKey = m_interpolation == Interpolation::CubicSpline ? 3 : 1;
    m_values = readFloats(document, s.output, scalars ? 1 : width, jsonPath + ".output",
                          keys * valuesPerKey * size_t(scalars ? width : 1));
    if (m_isRotation && m_interpolation != Interpolation::CubicSpline)
        for (size_t i = 0; i < m_times.size(); ++i)
            normalizeQuaternion(&m_values[4 * i]);
}

/// Returns the numbers of key i.
const float* Curve::key(size_t i, KeyPart part) const {
    const bool isSpline = m_interpolation == Interpolation::CubicSpline;
    const size_t index = isSpline ? 3 * i + size_t(part) : i;
    return &m_values[index * size_t(m_width)];
}

/// Evaluates the cubic Hermite spline between keys i and i + 1 at fraction `t`.
void Curve::evaluateSpline(size_t i, float t, float duration, float* out) const {
    const float t2 = t * t;
    const float t3 = t2 * t;
    const float* p0 = key(i);
    const float* m0 = key(i, OutTangent);
    const float* p1 = key(i + 1);
    const float* m1 = key(i + 1, InTangent);
    for (int k = 0; k < m_width; ++k)
        out[k] = (2 * t3 - 3 * t2 + 1) * p0[k] + (t3 - 2 * t2 + t) * duration * m0[k] +
                 (3 * t2 - 2 * t3) * p1[k] + (t3 - t2) * duration * m1[k];
}

void Curve::evaluate(float time, float* out) const {
    const auto next = std::upper_bound(m_times.begin(), m_times.end(), time);
    const size_t i = next == m_times.begin() ? 0 : size_t(next - m_times.begin()) - 1;
    const bool isBetween = next != m_times.begin() && next != m_times.end();
    if (!isBetween || m_interpolation == Interpolation::Step) {
        std::copy_n(key(i), m_width, out);
    } else {
        const float duration = m_times[i + 1] - m_times[i];
        const float t = (time - m_times[i]) / duration;
        if (m_interpolation == Interpolation::CubicSpline)
            evaluateSpline(i, t, duration, out);
        else if (m_isRotation)
            slerp(key(i), key(i + 1), t, out);
        else
            for (int k = 0; k < m_width; ++k)
                out[k] = lerp(key(i)[k], key(i + 1)[k], t);
    }
    if (m_isRotation)
        normalizeQuaternion(out);
}

Clip::Clip(const Document& document, const std::string& name, const std::vector<size_t>& morphTargets,
           Diagnostics& diagnostics)
    : m_nodes(document.model().nodes.size()) {
    if (!name.empty()) {
        add(document, findAnimation(document, name), morphTargets, diagnostics);
        return;
    }
    const auto& animations = document.model().animations;
    std::string skipped;
    for (size_t i = 0; i < animations.size(); ++i)
        if (!overlaps(animations[i]))
            add(document, i, morphTargets, diagnostics);
        else
            skipped += (skipped.empty() ? "\"" : ", \"") + animations[i].name + "\"";
    if (!skipped.empty())
        document.warnOnce(diagnostics, "clips", "animations",
                          "\"" + animations[0].name +
                              "\" plays; skipped, since they animate the same properties: " + skipped);
}

bool Clip::overlaps(const tinygltf::Animation& animation) const {
    for (const auto& channel : animation.channels) {
        if (channel.target_node < 0 || size_t(channel.target_node) >= m_nodes.size())
            continue;
        NodeCurves curves = m_nodes[size_t(channel.target_node)];
        if (const auto* curve = curveOf(curves, channel.target_path); curve && *curve)
            return true;
    }
    return false;
}

void Clip::add(const Document& document, size_t animation, const std::vector<size_t>& morphTargets,
               Diagnostics& diagnostics) {
    const auto& channels = document.model().animations[animation].channels;
    for (size_t c = 0; c < channels.size(); ++c) {
        const auto& channel = channels[c];
        const std::string jsonPath = item("animations", animation) + "." + item("channels", c);
        if (channel.target_node < 0)
            continue; // an extension defines the target
        document.at(document.model().nodes, channel.target_node, "node", jsonPath + ".target.node");
        const auto node = size_t(channel.target_node);
        auto* curve = curveOf(m_nodes[node], channel.target_path);
        if (!curve) {
            document.warnOnce(diagnostics, "path " + channel.target_path, jsonPath + ".target.path",
                              "unknown path \"" + channel.target_path + "\" is ignored");
            continue;
        }
        if (*curve)
            document.fail(jsonPath, "animates the same property as another channel");
        const bool isRotation = channel.target_path == "rotation";
        const bool isWeights = channel.target_path == "weights";
        if (isWeights && morphTargets[node] == 0)
            document.fail(jsonPath, "animates weights of a node without morph targets");
        const int width = isRotation ? 4 : isWeights ? int(morphTargets[node]) : 3;
        *curve =
            std::make_shared<Curve>(document, animation, channel.sampler, width, isRotation, diagnostics);
    }
}

float Clip::duration() const {
    float last = 0;
    for (const NodeCurves& node : m_nodes)
        for (const auto& curve : {node.translation, node.rotation, node.scale, node.weights})
            if (curve && !curve->times().empty())
                last = std::max(last, curve->times().back());
    return last;
}

void appendBreaks(const NodeCurves& curves, float open, float close, std::vector<float>& times) {
    for (const auto& curve : {curves.translation, curves.rotation, curves.scale, curves.weights}) {
        if (!curve)
            continue;
        const bool jumps = curve->interpolation() == Curve::Interpolation::Step;
        for (const float time : curve->times()) {
            if (time <= open || time >= close)
                continue;
            if (const float before = time - 1e-6f * (close - open); jumps && before > open && before < time)
                times.push_back(before);
            times.push_back(time);
        }
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
}

} // namespace strobe::gltf
