// Closed forms of the irradiance of area lights of radiance 1 at the origin of a floor with normal +z.
#pragma once

#include "core/math/math.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace strobe::test {

using Imath::V3d;

/// Returns the irradiance of a sphere of radiance 1, which may cross the horizon (Snyder, "Area Light Sources
/// for Real-Time Graphics", 1996).
inline double sphereIrradiance(const V3d& center, double radius) {
    const double d = center.length(), mu = center.z / d, s2 = radius * radius / (d * d);
    if (mu * mu > s2)
        return mu > 0 ? M_PI * s2 * mu : 0;
    const double q = 1 / s2 - 1, k = std::sqrt(1 - mu * mu / s2);
    return s2 * (mu * std::acos(-mu * std::sqrt(q / (1 - mu * mu))) - k * std::sqrt(q)) +
           std::atan(k / std::sqrt(q));
}

/// Returns the irradiance of a disk of radiance 1, parallel to the floor at height h, whose center is at
/// distance a from the z axis.
inline double diskIrradiance(double h, double radius, double a) {
    const double h2 = h * h, r2 = radius * radius, a2 = a * a, z = a2 + h2 + r2;
    return M_PI / 2 * (1 - (a2 + h2 - r2) / std::sqrt(z * z - 4 * r2 * a2));
}

/// Returns the irradiance of a two-sided polygon of radiance 1: Lambert's formula, clipped at the horizon.
inline double polygonIrradiance(const std::vector<V3d>& corners) {
    std::vector<V3d> above; // clipped at z = 0
    for (size_t i = 0; i < corners.size(); ++i) {
        const V3d &a = corners[i], &b = corners[(i + 1) % corners.size()];
        if (a.z >= 0)
            above.push_back(a);
        if ((a.z < 0) != (b.z < 0))
            above.push_back(a + (b - a) * (a.z / (a.z - b.z)));
    }
    double sum = 0;
    for (size_t i = 0; i < above.size(); ++i) {
        const V3d a = above[i].normalized(), b = above[(i + 1) % above.size()].normalized();
        const V3d normal = a.cross(b);
        if (normal.length() > 0)
            sum += std::acos(std::clamp(a.dot(b), -1.0, 1.0)) * normal.z / normal.length();
    }
    return std::abs(sum) / 2;
}

/// Returns the mean over the shutter of a smooth function of the shutter fraction.
inline double meanOverShutter(const std::function<double(double)>& irradiance) {
    constexpr int kSteps = 2000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        sum += irradiance((i + .5) / kSteps);
    return sum / kSteps;
}

} // namespace strobe::test
