// Animated transforms with any number of keys, interpolated as translation, rotation and stretch.
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"

#include <array>
#include <vector>

namespace STROBE_API strobe {

/// The transform that is interpolated between keys: object-to-world as in pbrt-v3 and v4, or world-to-object
/// as in pbrt-v2.
enum class MotionConvention { ObjectToWorld, WorldToObject };

/// A transform M = S R T. Vectors are rows, so p M = p S R T: the stretch applies first, then the rotation,
/// then the translation.
struct Decomposed {
    V3f translation{0};
    Quatf rotation;
    M44f stretch; ///< in the upper left 3x3 matrix; symmetric after `decompose`
};
/// Returns the polar decomposition of `m` (Shoemake and Duff, "Matrix Animation and Polar Decomposition",
/// 1992), as in pbrt. A reflection becomes part of `stretch`.
Decomposed decompose(const M44f& m);
/// Returns the matrix S R T.
M44f compose(const Decomposed& d);
/// Interpolates from a (t = 0) to b (t = 1): linearly in translation and stretch, by slerp along the shortest
/// arc in rotation.
Decomposed interpolate(const Decomposed& a, const Decomposed& b, float t);

/// An object-to-world transform given by keys in scene time. It is constant before the first key and after
/// the last key.
class KeyedTransform {
  public:
    KeyedTransform() : KeyedTransform(M44f()) {}
    /// Makes a static transform.
    explicit KeyedTransform(const M44f& matrix);
    /// Makes a transform with object-to-world matrices `keys` at `times`. Precondition: `times` ascend, and
    /// there are as many times as keys (else throws std::logic_error). If all keys agree with the first to a
    /// relative error of 1e-6, the transform is static.
    KeyedTransform(std::vector<float> times, std::vector<M44f> keys, MotionConvention convention);

    bool isStatic() const { return m_keys.size() == 1; }
    /// Returns the interpolated object-to-world matrix at scene time `time`.
    M44f at(float time) const;
    const std::vector<float>& times() const { return m_times; }
    /// Returns the object-to-world matrices of the keys; a single one if the transform is static.
    const std::vector<M44f>& keys() const { return m_keys; }
    bool operator==(const KeyedTransform& other) const {
        return m_times == other.m_times && m_keys == other.m_keys && m_convention == other.m_convention;
    }

  private:
    std::vector<float> m_times;
    std::vector<M44f> m_keys;
    /// The keys, or their inverses for WorldToObject; empty if static. Rotations of neighboring keys lie in
    /// one hemisphere of the unit quaternions.
    std::vector<Decomposed> m_decomposed;
    MotionConvention m_convention = MotionConvention::ObjectToWorld;
};

/// A product of nested transforms. The first one is the innermost and applies first.
class TransformChain {
  public:
    TransformChain() = default;
    TransformChain(KeyedTransform t) { append(std::move(t)); } // NOLINT: implicit
    /// Appends `t`, which applies after the present transforms. Adjacent static transforms are merged.
    void append(KeyedTransform t);
    bool isStatic() const { return m_chain.size() <= 1 && (m_chain.empty() || m_chain.front().isStatic()); }
    /// Returns the product at scene time `time`.
    M44f at(float time) const;
    const std::vector<KeyedTransform>& chain() const { return m_chain; }
    bool operator==(const TransformChain& other) const { return m_chain == other.m_chain; }

  private:
    std::vector<KeyedTransform> m_chain;
};

/// The interval during which the shutter is open, in scene time.
struct Shutter {
    float open = 0, close = 1;
    /// Converts a shutter fraction in [0,1] to scene time.
    float sceneTime(float fraction) const { return open + fraction * (close - open); }
};

/// Returns whether `path` is constant, to a relative error of 1e-6, while the shutter is open.
bool isStaticDuring(const TransformChain& path, const Shutter& shutter);

/// Affine transforms as a structure of arrays.
struct AffineSoA {
    V3SoA x, y, z; ///< the rows of the linear part: images of the axes
    V3SoA o;       ///< the translation
    void set(int i, const M44f& m) {
        x.set(i, {m[0][0], m[0][1], m[0][2]});
        y.set(i, {m[1][0], m[1][1], m[1][2]});
        z.set(i, {m[2][0], m[2][1], m[2][2]});
        o.set(i, {m[3][0], m[3][1], m[3][2]});
    }
};

/// An object-to-world transform over the shutter interval in Embree's form: equidistant keys that are either
/// matrices, interpolated linearly, or decomposed into translation, rotation and stretch, with slerp of the
/// rotation. The tracer and the shader both use it, so that intersections and surface points agree.
class Motion {
  public:
    Motion() : Motion(M44f()) {}
    /// Makes a static transform.
    explicit Motion(const M44f& matrix);
    /// Fits `path` over the shutter interval with the smallest number of keys, at most `maxKeys` (Embree's
    /// limit is 129), for which every corner of `bounds` (object space) deviates from the path by at most
    /// `tolerance` (world units). The deviation is tested at the keys of the path and at three times between
    /// neighboring keys of the fit.
    Motion(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
           int maxKeys = 129);

    bool isStatic() const { return m_count == 1; }
    int keyCount() const { return m_count; }
    /// Returns false if `maxKeys` keys do not reach the tolerance.
    bool converged() const { return m_converged; }
    /// Returns whether the keys are decomposed, with slerp of the rotation.
    bool usesRotation() const { return !m_decomposed.empty(); }
    /// Returns whether the linear part is constant, to a relative error of 1e-6: directions and lengths do
    /// not change.
    bool onlyTranslates() const { return m_onlyTranslates; }
    /// Returns the object-to-world matrix at shutter fraction `time`, clamped to [0,1].
    M44f at(float time) const;
    /// Evaluates times begin … end-1; same results as `at`, to the bit.
    void atSoA(const float* time, int begin, int end, AffineSoA& out) const;
    /// Returns key i as a matrix.
    const M44f& matrixKey(int i) const { return m_matrices[i]; }
    /// Returns key i in the form of RTCQuaternionDecomposition: translation, rotation and a triangular matrix
    /// of scale and skew (`stretch`). Precondition: usesRotation().
    const Decomposed& quaternionKey(int i) const { return m_decomposed[i]; }

  private:
    /// The rotation between two keys at fraction t: start cos(t angle) + normal sin(t angle).
    struct Slerp {
        Quatf start, normal; ///< orthogonal unit quaternions
        float angle;         ///< between the quaternions, half the angle of the rotation; in full turns
        Slerp(const Quatf& a, const Quatf& b);
    };
    void fit(const TransformChain& path, const Shutter& shutter, const Box3f& bounds, float tolerance,
             int maxKeys);
    /// Decomposes the matrices of the keys.
    void decomposeKeys();
    bool hasConstantLinearPart() const;

    int m_count = 1;
    bool m_converged = true;
    bool m_onlyTranslates = true;
    std::vector<M44f> m_matrices;
    std::vector<Decomposed> m_decomposed; ///< by key; empty unless usesRotation()
    std::vector<Slerp> m_slerps;          ///< by pair of neighboring keys
};

} // namespace strobe
