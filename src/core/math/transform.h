// Transforms that move: any number of keys, decomposed into translation, rotation and stretch.
#pragma once

#include "core/math/soa.h"

#include <array>
#include <vector>

namespace strobe {

/// What is interpolated between keys: pbrt-v3 and v4 interpolate object-to-world, pbrt-v2 world-to-object.
enum class MotionConvention { ObjectToWorld, WorldToObject };

/// M = S · R · T in row-vector order (p S R T): stretch first, then rotation, then translation.
struct Decomposed {
    V3f translation{0};
    Quatf rotation;
    M44f stretch; ///< symmetric, upper-left 3x3
};
/// Polar decomposition (Shoemake & Duff 1992), as pbrt does it. A reflection ends up in `stretch`.
Decomposed decompose(const M44f& m);
M44f compose(const Decomposed& d);
/// Linear in translation and stretch, shortest-path slerp in rotation.
Decomposed interpolate(const Decomposed& a, const Decomposed& b, float t);

/// An object-to-world transform given at keys in scene time. Before the first key and after the last it
/// rests.
class KeyedTransform {
  public:
    KeyedTransform() : KeyedTransform(M44f()) {}
    explicit KeyedTransform(const M44f& still);
    /// `times` ascending, as many as `keys`. Keys that agree to 1e-6 of their size make a still transform.
    KeyedTransform(std::vector<float> times, std::vector<M44f> keys, MotionConvention convention);

    bool isStatic() const { return m_keys.size() == 1; }
    /// Object-to-world at scene time `time`.
    M44f at(float time) const;
    const std::vector<float>& times() const { return m_times; }
    /// The object-to-world keys as given (one when still).
    const std::vector<M44f>& keys() const { return m_keys; }
    bool operator==(const KeyedTransform& other) const {
        return m_times == other.m_times && m_keys == other.m_keys && m_convention == other.m_convention;
    }

  private:
    std::vector<float> m_times;
    std::vector<M44f> m_keys;
    std::vector<Decomposed> m_parts; ///< of the keys, or of their inverses; rotations in one hemisphere
    MotionConvention m_convention = MotionConvention::ObjectToWorld;
};

/// Nested transforms: the first is the innermost (applied first).
class TransformChain {
  public:
    TransformChain() = default;
    TransformChain(KeyedTransform t) { append(std::move(t)); } // NOLINT: implicit
    /// Applies `t` after what is there. Still neighbors are merged.
    void append(KeyedTransform t);
    bool isStatic() const { return m_chain.size() <= 1 && (m_chain.empty() || m_chain.front().isStatic()); }
    M44f at(float time) const;
    const std::vector<KeyedTransform>& chain() const { return m_chain; }
    bool operator==(const TransformChain& other) const { return m_chain == other.m_chain; }

  private:
    std::vector<KeyedTransform> m_chain;
};

/// The interval during which the shutter is open, in scene time.
struct Shutter {
    float open = 0, close = 1;
    float sceneTime(float fraction) const { return open + fraction * (close - open); }
};

/// True when the path stays where it is (to 1e-6 of its size) while the shutter is open.
bool isStaticDuring(const TransformChain& path, const Shutter& shutter);

/// Transforms side by side: their rows, without the column that all transforms share.
struct AffineSoA {
    V3SoA x, y, z, o;
    void set(int i, const M44f& m) {
        x.set(i, {m[0][0], m[0][1], m[0][2]}), y.set(i, {m[1][0], m[1][1], m[1][2]});
        z.set(i, {m[2][0], m[2][1], m[2][2]}), o.set(i, {m[3][0], m[3][1], m[3][2]});
    }
};

/// A path over the shutter in the form in which Embree follows it: uniform keys, either matrices interpolated
/// linearly or translation-rotation-stretch with slerp. What the tracer intersects and what shading
/// transforms by are this one thing.
class Motion {
  public:
    Motion() : Motion(M44f()) {}
    explicit Motion(const M44f& still);
    /// Fits `path` over the shutter: as few keys as keep every corner of `bounds` (object space) within
    /// `tolerance` (world units) of the path at all times, tested between the keys; at most `maxKeys` (129 is
    /// Embree's limit).
    Motion(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
           int maxKeys = 129);

    bool isStatic() const { return m_count == 1; }
    int keyCount() const { return m_count; }
    /// False when even `maxKeys` keys do not keep to the tolerance.
    bool converged() const { return m_converged; }
    bool usesRotation() const { return !m_rotating.empty(); }
    /// Directions and lengths stay as they are (to 1e-6): all that moves is the place.
    bool onlyTranslates() const { return m_onlyTranslates; }
    /// Object-to-world at shutter fraction `time`.
    M44f at(float time) const;
    /// Those of times `begin` to `end`.
    void atSoA(const float* time, int begin, int end, AffineSoA& out) const;
    /// Key i as a matrix / as parts whose `stretch` is upper triangular (Embree's decomposition, QR).
    const M44f& matrixKey(int i) const { return m_matrices[i]; }
    const Decomposed& rotationKey(int i) const { return m_rotating[i]; }

  private:
    /// The rotation of a segment: from · cos(t · turns) + across · sin(t · turns).
    struct Slerp {
        Quatf from, across; ///< of unit length, at right angles
        float turns;        ///< of the quaternion, which is half the rotation's angle; in full turns
        Slerp(const Quatf& a, const Quatf& b);
    };
    void fit(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
             int maxKeys);
    void findRotations();
    bool keepsDirections() const;

    int m_count = 1;
    bool m_converged = true, m_onlyTranslates = true;
    std::vector<M44f> m_matrices;
    std::vector<Decomposed> m_rotating;
    std::vector<Slerp> m_slerps; ///< by segment
};

} // namespace strobe
