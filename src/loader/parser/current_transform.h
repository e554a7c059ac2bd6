// The current transform of the scene language: one matrix per key of TransformTimes.
#pragma once

#include "core/math/transform.h"
#include "core/util/error.h"

#include <array>
#include <vector>

namespace strobe {

using Imath::M44d;

// Transforms as the scene language writes them, for row vectors; angles in degrees. Each throws a located
// Error when it has no inverse.
M44d translation(double x, double y, double z);
M44d scaling(double x, double y, double z, const Location& where);
M44d rotation(double degrees, double x, double y, double z, const Location& where);
/// World to camera; left-handed: x is cross(up, look - eye).
M44d lookAt(const std::array<double, 9>& eyeLookUp, const Location& where);
/// Sixteen numbers in pbrt's order, which is Imath's. The last column must be 0 0 0 1.
M44d fromNumbers(const std::array<double, 16>& numbers, const Location& where);

/// The current transform and which of its keys are active. Kept in double precision, so that long chains of
/// statements lose nothing.
class CurrentTransform {
  public:
    static constexpr int kAll = -1;

    explicit CurrentTransform(size_t keys = 2) : m_keys(keys) {}
    size_t count() const { return m_keys.size(); }
    const std::vector<M44d>& keys() const { return m_keys; }
    void setKeys(std::vector<M44d> keys) { m_keys = std::move(keys); }
    int active() const { return m_active; }
    /// One key, or kAll.
    void setActive(int key) { m_active = key; }
    bool allEqual() const;
    /// Changes the number of keys; all must be equal.
    void setCount(size_t count) { m_keys.assign(count, M44d(m_keys.front())); }

    /// `t` before what is there: t * key, for the active keys. Throws when that cannot be inverted in floats.
    void apply(const M44d& t, const Location& where);
    /// Replaces the active keys.
    void set(const M44d& t);
    /// The inverse of each key.
    std::vector<M44d> inverses() const;

  private:
    template <class F>
    void forActive(F f);
    std::vector<M44d> m_keys;
    int m_active = kAll;
};

/// In single precision, as the renderer uses it; still when all keys are equal.
KeyedTransform toKeyed(const std::vector<M44d>& keys, const std::vector<float>& times);

} // namespace strobe
