// Animation: curves over time, and the selection of animations that play.
#pragma once

#include "core/math/math.h"
#include "core/util/diagnostics.h"
#include "gltf/file/document.h"

#include <array>
#include <map>
#include <memory>

namespace strobe::gltf {

/// An animation sampler: values of `width` numbers at ascending times, in seconds. Constant before the first
/// time and after the last.
class Curve {
  public:
    enum class Interpolation { Step, Linear, CubicSpline };

    /// Reads sampler `sampler` of animation `animation`. `isRotation`: the values are unit quaternions (x y z
    /// w), which are interpolated spherically. Throws an Error if the sampler is invalid. Keys from the first
    /// one on whose time does not ascend are tolerated, and ignored.
    Curve(const Document& document, size_t animation, int sampler, int width, bool isRotation,
          Diagnostics& diagnostics);

    int width() const { return m_width; }
    Interpolation interpolation() const { return m_interpolation; }
    const std::vector<float>& times() const { return m_times; }
    /// Writes the value at `time`, `width` numbers, to `out`.
    void evaluate(float time, float* out) const;

  private:
    /// The numbers that a key stores: one value, or for splines three.
    enum KeyPart { InTangent, Value, OutTangent };
    const float* key(size_t i, KeyPart part = Value) const;
    void evaluateSpline(size_t i, float t, float duration, float* out) const;

    int m_width;
    bool m_isRotation;
    Interpolation m_interpolation = Interpolation::Linear;
    std::vector<float> m_times;
    std::vector<float> m_values; ///< per key; of splines: in-tangent, value, out-tangent
};

/// The animated properties of a node; null: not animated.
struct NodeCurves {
    std::shared_ptr<const Curve> translation, rotation, scale, weights;
    /// Returns true if the node's transform is animated.
    bool moves() const { return translation || rotation || scale; }
    bool isEmpty() const { return !moves() && !weights; }
};

/// The animations that play: the animation of a given name, or by default the first and all later ones that
/// animate no property of an earlier one, since exporters write one animation per object.
class Clip {
  public:
    /// `name`: name of the animation; empty: the default. `morphTargets`: number of morph targets by node.
    /// Warns about animations that do not play. Throws an Error if an animation is invalid or the name
    /// unknown.
    Clip(const Document& document, const std::string& name, const std::vector<size_t>& morphTargets,
         Diagnostics& diagnostics);
    const NodeCurves& curves(size_t node) const { return m_nodes[node]; }
    /// Returns the last time of all curves; 0 if nothing is animated.
    float duration() const;

  private:
    void add(const Document& document, size_t animation, const std::vector<size_t>& morphTargets,
             Diagnostics& diagnostics);
    bool overlaps(const tinygltf::Animation& animation) const;

    std::vector<NodeCurves> m_nodes;
};

/// Appends the times in the open interval (open, close) where the curves have a corner; for a jump, the time
/// of the jump and a time just before it. Sorts `times` and removes duplicates.
void appendBreaks(const NodeCurves& curves, float open, float close, std::vector<float>& times);

} // namespace strobe::gltf
