// The current transformation matrix (CTM) of the scene language: one matrix per key of TransformTimes.
#pragma once

#include "core/math/transform.h"
#include "core/util/error.h"

#include <array>
#include <vector>

namespace strobe {

using Imath::M44d;

// The transforms of the scene language, for row vectors; angles in degrees. Each function that takes a
// location throws an Error there if the transform has no inverse.
M44d translation(double x, double y, double z);
M44d scaling(double x, double y, double z, const Location& where);
M44d rotation(double degrees, double x, double y, double z, const Location& where);
/// Returns the world-to-camera transform of LookAt. It is left-handed: x is cross(up, look - eye).
M44d lookAt(const std::array<double, 9>& eyeLookUp, const Location& where);
/// Returns the matrix of sixteen numbers, row by row as in pbrt and Imath. Throws if the last column is not
/// 0 0 0 1.
M44d matrixFromNumbers(const std::array<double, 16>& numbers, const Location& where);

/// The current transform and the active keys. Double precision keeps long chains of transforms accurate.
class CurrentTransform {
  public:
    static constexpr int kAll = -1;

    explicit CurrentTransform(size_t keys = 2) : m_keys(keys) {}
    size_t count() const { return m_keys.size(); }
    const std::vector<M44d>& keys() const { return m_keys; }
    void setKeys(std::vector<M44d> keys) { m_keys = std::move(keys); }
    int active() const { return m_active; }
    /// Sets the active key: an index, or kAll.
    void setActive(int key) { m_active = key; }
    /// Changes the number of keys. Precondition: all keys are equal.
    void setCount(size_t count) { m_keys.assign(count, M44d(m_keys.front())); }

    /// Replaces each active key by t * key, which applies `t` first. Throws an Error at `where` if the
    /// product is not invertible in single precision.
    void apply(const M44d& t, const Location& where);
    /// Replaces the active keys by `t`.
    void set(const M44d& t);
    /// Returns the inverse of each key.
    std::vector<M44d> inverses() const;

  private:
    template <class F>
    void forActive(F f);
    std::vector<M44d> m_keys;
    int m_active = kAll;
};

/// Returns the transform in single precision; static if all keys are equal.
KeyedTransform toKeyed(const std::vector<M44d>& keys, const std::vector<float>& times);

} // namespace strobe
