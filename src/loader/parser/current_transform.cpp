#include "loader/parser/current_transform.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strobe {
namespace {

using Imath::V3d;

V3d row(const M44d& m, int i) { return {m[i][0], m[i][1], m[i][2]}; }

double determinant3(const M44d& m) { return row(m, 0).dot(row(m, 1).cross(row(m, 2))); }

/// Returns true if the determinant exceeds rounding error and is within the range of a float.
bool isInvertible(const M44d& m) {
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            if (!(std::abs(m[i][j]) < 1e37)) // also catches NaN
                return false;
    const double volume = std::abs(determinant3(m));
    const double box = row(m, 0).length() * row(m, 1).length() * row(m, 2).length();
    return volume > 1e-12 * box && volume > 1e-35 && volume < 1e35;
}

/// Returns `m`. Throws an Error with `message` if it is not invertible.
M44d checked(const M44d& m, const Location& where, const char* message) {
    if (!isInvertible(m))
        throw Error(where, message);
    return m;
}

M44f toFloat(const M44d& m) { return M44f(m); }

} // namespace

M44d translation(double x, double y, double z) { return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1}; }

M44d scaling(double x, double y, double z, const Location& where) {
    return checked({x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}, where,
                   "Scale factors must not be zero, or too large or too small to invert");
}

M44d rotation(double degrees, double x, double y, double z, const Location& where) {
    const double l = V3d(x, y, z).length();
    if (!(l > 0) || !std::isfinite(l))
        throw Error(where, "Rotate: the axis is zero");
    const V3d a = V3d(x, y, z) / l;
    const double turn = std::fmod(degrees, 360.0);
    const double angle = turn * (std::numbers::pi / 180);
    // Multiples of 90 degrees are exact: axis-aligned scenes stay axis-aligned.
    const double s = turn == std::trunc(turn) && std::fmod(turn, 180) == 0 ? 0 : std::sin(angle);
    const double c = turn == std::trunc(turn) && std::fmod(turn, 180) != 0 && std::fmod(turn, 90) == 0
                         ? 0
                         : std::cos(angle);
    const double d = 1 - c; // Rodrigues' formula, transposed for row vectors
    return {c + a.x * a.x * d,
            a.x * a.y * d + a.z * s,
            a.x * a.z * d - a.y * s,
            0,
            a.x * a.y * d - a.z * s,
            c + a.y * a.y * d,
            a.y * a.z * d + a.x * s,
            0,
            a.x * a.z * d + a.y * s,
            a.y * a.z * d - a.x * s,
            c + a.z * a.z * d,
            0,
            0,
            0,
            0,
            1};
}

M44d lookAt(const std::array<double, 9>& n, const Location& where) {
    const V3d eye(n[0], n[1], n[2]);
    const V3d look(n[3], n[4], n[5]);
    const V3d up(n[6], n[7], n[8]);
    if (!((look - eye).length() > 0))
        throw Error(where, "LookAt: the eye and the look-at point are the same");
    if (!(up.length() > 0))
        throw Error(where, "LookAt: the up vector is zero");
    const V3d z = (look - eye).normalized();
    const V3d right = up.normalized().cross(z);
    if (!(right.length() > 1e-6))
        throw Error(where, "LookAt: the up vector is parallel to the viewing direction");
    const V3d x = right.normalized();
    const V3d y = z.cross(x);
    return checked(
        {x.x, y.x, z.x, 0, x.y, y.y, z.y, 0, x.z, y.z, z.z, 0, -eye.dot(x), -eye.dot(y), -eye.dot(z), 1},
        where, "LookAt: the numbers are too large");
}

M44d matrixFromNumbers(const std::array<double, 16>& n, const Location& where) {
    M44d m(n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9], n[10], n[11], n[12], n[13], n[14],
           n[15]);
    constexpr double kRounding = 1e-6; // of exporters
    const bool affine =
        std::abs(m[0][3]) < kRounding && std::abs(m[1][3]) < kRounding && std::abs(m[2][3]) < kRounding;
    if (!affine || std::abs(m[3][3]) < kRounding)
        throw Error(where, "the last column of the matrix (every fourth number) must be 0 0 0 1");
    if (std::abs(m[3][3] - 1) > kRounding) // homogeneous coordinates
        m *= 1 / m[3][3];
    m[0][3] = m[1][3] = m[2][3] = 0;
    m[3][3] = 1;
    return checked(m, where, "the matrix is singular: it has no inverse");
}

template <class F>
void CurrentTransform::forActive(F f) {
    if (m_active == kAll)
        std::for_each(m_keys.begin(), m_keys.end(), f);
    else
        f(m_keys[m_active]);
}

void CurrentTransform::apply(const M44d& t, const Location& where) {
    forActive([&](M44d& key) {
        key = checked(t * key, where, "the current transform becomes too large or too small to invert");
    });
}

void CurrentTransform::set(const M44d& t) {
    forActive([&](M44d& key) { key = t; });
}

std::vector<M44d> CurrentTransform::inverses() const {
    std::vector<M44d> inverses;
    for (const M44d& key : m_keys)
        inverses.push_back(key.inverse());
    return inverses;
}

KeyedTransform toKeyed(const std::vector<M44d>& keys, const std::vector<float>& times) {
    std::vector<M44f> floats(keys.size());
    std::transform(keys.begin(), keys.end(), floats.begin(), toFloat);
    if (std::all_of(floats.begin(), floats.end(), [&](const M44f& k) { return k == floats.front(); }))
        return KeyedTransform(floats.front());
    return KeyedTransform(times, std::move(floats), MotionConvention::ObjectToWorld);
}

} // namespace strobe
