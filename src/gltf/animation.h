// Animation: curves over time, and the clip of them that plays.
#pragma once

#include "core/math/math.h"
#include "gltf/document.h"

#include <array>
#include <map>
#include <memory>

namespace strobe::gltf {

/// An animation sampler: values of `width` numbers at ascending times, in seconds. Before the first and after
/// the last time it rests.
class Curve {
  public:
    enum class Interpolation { Step, Linear, CubicSpline };

    /// Reads and checks sampler `sampler` of animation `animation`. `rotates`: its values are unit
    /// quaternions (x y z w), interpolated along great arcs.
    Curve(const Document& document, size_t animation, int sampler, int width, bool rotates);

    int width() const { return m_width; }
    Interpolation interpolation() const { return m_interpolation; }
    const std::vector<float>& times() const { return m_times; }
    /// Fills `out` with `width` numbers: the value at `time`.
    void at(float time, float* out) const;

  private:
    const float* key(size_t i, int part = 0) const;
    void hermite(size_t i, float t, float duration, float* out) const;

    int m_width;
    bool m_rotates;
    Interpolation m_interpolation = Interpolation::Linear;
    std::vector<float> m_times;
    std::vector<float> m_values; ///< per key; of splines: in-tangent, value, out-tangent
};

/// What of a node is animated; null: at rest.
struct NodeCurves {
    std::shared_ptr<const Curve> translation, rotation, scale, weights;
    bool moves() const { return translation || rotation || scale; }
    bool isEmpty() const { return !moves() && !weights; }
};

/// The animations that play. By default the first, and each later one that animates nothing that an earlier
/// one does (exporters write one animation per object); one chosen by name plays alone.
class Clip {
  public:
    /// `name`: empty for the default. `morphTargets`: per node, how many weights its mesh has.
    Clip(const Document& document, const std::string& name, const std::vector<size_t>& morphTargets,
         Diagnostics& messages);
    const NodeCurves& of(size_t node) const { return m_nodes[node]; }

  private:
    void add(const Document& document, size_t animation, const std::vector<size_t>& morphTargets,
             Diagnostics& messages);
    bool overlaps(const tinygltf::Animation& animation) const;

    std::vector<NodeCurves> m_nodes;
};

/// The times within (open, close) where curves have a corner, or (just before and at) a jump: appended.
void appendBreaks(const NodeCurves& curves, float open, float close, std::vector<float>& times);

} // namespace strobe::gltf
