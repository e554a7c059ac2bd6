#include "gltf/animation.h"

#include "core/util/nearest_name.h"
#include "gltf/accessor.h"

#include <algorithm>

namespace strobe::gltf {
namespace {

/// Interpolates unit quaternions along the shorter arc.
void slerp(const float* a, const float* b, float t, float* out) {
    float cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    const float sign = cosine < 0 ? -1.f : 1.f;
    cosine = std::min(std::abs(cosine), 1.f);
    float wa = 1 - t, wb = t;
    if (cosine < 0.9999f) {
        const float angle = std::acos(cosine), scale = 1 / std::sin(angle);
        wa = std::sin((1 - t) * angle) * scale, wb = std::sin(t * angle) * scale;
    }
    for (int k = 0; k < 4; ++k)
        out[k] = wa * a[k] + wb * sign * b[k];
}

void normalizeQuaternion(float* q) {
    const float l2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const float scale = l2 > 0 ? 1 / std::sqrt(l2) : 0;
    for (int k = 0; k < 4; ++k)
        q[k] *= scale;
    if (l2 == 0)
        q[3] = 1;
}

Curve::Interpolation interpolationOf(const Document& document, const std::string& name,
                                     const std::string& place) {
    if (name == "LINEAR" || name.empty())
        return Curve::Interpolation::Linear;
    if (name == "STEP")
        return Curve::Interpolation::Step;
    if (name == "CUBICSPLINE")
        return Curve::Interpolation::CubicSpline;
    document.fail(place + ".interpolation", "unknown \"" + name + "\" (known: STEP, LINEAR, CUBICSPLINE)");
}

/// The curve of `curves` that a channel's path names, or null.
std::shared_ptr<const Curve>* slot(NodeCurves& curves, const std::string& path) {
    return path == "translation" ? &curves.translation
           : path == "rotation"  ? &curves.rotation
           : path == "scale"     ? &curves.scale
           : path == "weights"   ? &curves.weights
                                 : nullptr;
}

size_t findClip(const Document& document, const std::string& name) {
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
    document.fail("animations", message + (list.empty() ? " (it has none)" : " (it has: " + list + ")"));
}

} // namespace

Curve::Curve(const Document& document, size_t animation, int sampler, int width, bool rotates)
    : m_width(width), m_rotates(rotates) {
    const std::string list = item("animations", animation) + ".samplers";
    const auto& s = document.at(document.model().animations[animation].samplers, sampler, "sampler", list);
    const std::string place = list + "[" + std::to_string(sampler) + "]";
    m_interpolation = interpolationOf(document, s.interpolation, place);
    m_times = readFloats(document, s.input, 1, place + ".input");
    if (m_times.empty())
        document.fail(place + ".input", "has no keys");
    for (size_t i = 1; i < m_times.size(); ++i)
        if (!(m_times[i] > m_times[i - 1]))
            document.fail(place + ".input", "the times do not ascend at key " + std::to_string(i));
    // Weights are one scalar each; all other values are vectors.
    const int components = accessorComponents(document, s.output, place + ".output");
    const bool scalars = components == 1 && width != 1;
    const size_t parts = m_interpolation == Interpolation::CubicSpline ? 3 : 1;
    m_values = readFloats(document, s.output, scalars ? 1 : width, place + ".output",
                          m_times.size() * parts * size_t(scalars ? width : 1));
    if (m_rotates && m_interpolation != Interpolation::CubicSpline)
        for (size_t i = 0; i < m_times.size(); ++i)
            normalizeQuaternion(&m_values[4 * i]);
}

/// The numbers of key i; of a spline, part 0 is the in-tangent, 1 the value, 2 the out-tangent.
const float* Curve::key(size_t i, int part) const {
    const size_t parts = m_interpolation == Interpolation::CubicSpline ? 3 : 1;
    return &m_values[(i * parts + size_t(part)) * size_t(m_width)];
}

void Curve::hermite(size_t i, float t, float duration, float* out) const {
    const float t2 = t * t, t3 = t2 * t;
    const float *p0 = key(i, 1), *m0 = key(i, 2), *p1 = key(i + 1, 1), *m1 = key(i + 1, 0);
    for (int k = 0; k < m_width; ++k)
        out[k] = (2 * t3 - 3 * t2 + 1) * p0[k] + (t3 - 2 * t2 + t) * duration * m0[k] +
                 (3 * t2 - 2 * t3) * p1[k] + (t3 - t2) * duration * m1[k];
}

void Curve::at(float time, float* out) const {
    const bool spline = m_interpolation == Interpolation::CubicSpline;
    const auto next = std::upper_bound(m_times.begin(), m_times.end(), time);
    const size_t i = next == m_times.begin() ? 0 : size_t(next - m_times.begin()) - 1;
    const bool isBetween = next != m_times.begin() && next != m_times.end();
    if (!isBetween || m_interpolation == Interpolation::Step) {
        std::copy_n(key(i, spline ? 1 : 0), m_width, out);
    } else {
        const float duration = m_times[i + 1] - m_times[i], t = (time - m_times[i]) / duration;
        if (spline)
            hermite(i, t, duration, out);
        else if (m_rotates)
            slerp(key(i), key(i + 1), t, out);
        else
            for (int k = 0; k < m_width; ++k)
                out[k] = lerp(key(i)[k], key(i + 1)[k], t);
    }
    if (m_rotates)
        normalizeQuaternion(out);
}

Clip::Clip(const Document& document, const std::string& name, const std::vector<size_t>& morphTargets,
           Diagnostics& messages)
    : m_nodes(document.model().nodes.size()) {
    if (!name.empty()) {
        add(document, findClip(document, name), morphTargets, messages);
        return;
    }
    const auto& animations = document.model().animations;
    std::string others;
    for (size_t i = 0; i < animations.size(); ++i)
        if (!overlaps(animations[i]))
            add(document, i, morphTargets, messages);
        else
            others += (others.empty() ? "\"" : ", \"") + animations[i].name + "\"";
    if (!others.empty())
        document.warnOnce(messages, "clips", "animations",
                          "\"" + animations[0].name +
                              "\" plays; not played, since they move the same: " + others);
}

bool Clip::overlaps(const tinygltf::Animation& animation) const {
    for (const auto& channel : animation.channels) {
        if (channel.target_node < 0 || size_t(channel.target_node) >= m_nodes.size())
            continue;
        NodeCurves curves = m_nodes[size_t(channel.target_node)];
        if (const auto* curve = slot(curves, channel.target_path); curve && *curve)
            return true;
    }
    return false;
}

void Clip::add(const Document& document, size_t animation, const std::vector<size_t>& morphTargets,
               Diagnostics& messages) {
    const auto& channels = document.model().animations[animation].channels;
    for (size_t c = 0; c < channels.size(); ++c) {
        const auto& channel = channels[c];
        const std::string place = item("animations", animation) + "." + item("channels", c);
        if (channel.target_node < 0)
            continue; // the specification's way of leaving the target to an extension
        document.at(document.model().nodes, channel.target_node, "node", place + ".target.node");
        const auto node = size_t(channel.target_node);
        auto* curve = slot(m_nodes[node], channel.target_path);
        if (!curve) {
            document.warnOnce(messages, "path " + channel.target_path, place + ".target.path",
                              "\"" + channel.target_path + "\" is not animated");
            continue;
        }
        if (*curve)
            document.fail(place, "animates what another channel does");
        const bool rotates = channel.target_path == "rotation", weighs = channel.target_path == "weights";
        if (weighs && morphTargets[node] == 0)
            document.fail(place, "animates weights of a node without morph targets");
        const int width = rotates ? 4 : weighs ? int(morphTargets[node]) : 3;
        *curve = std::make_shared<Curve>(document, animation, channel.sampler, width, rotates);
    }
}

void appendBreaks(const NodeCurves& curves, float open, float close, std::vector<float>& times) {
    for (const auto& curve : {curves.translation, curves.rotation, curves.scale, curves.weights}) {
        if (!curve)
            continue;
        const bool jumps = curve->interpolation() == Curve::Interpolation::Step;
        const auto& keys = curve->times();
        for (auto it = std::upper_bound(keys.begin(), keys.end(), open); it != keys.end() && *it < close;
             ++it) {
            if (const float before = *it - 1e-6f * (close - open); jumps && before > open && before < *it)
                times.push_back(before);
            times.push_back(*it);
        }
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
}

} // namespace strobe::gltf
