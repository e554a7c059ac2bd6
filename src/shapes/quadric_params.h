// Parameters and functions that quadrics share.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/fast_math.h"
#include "core/params/plugin.h"

namespace strobe {

using Imath::V2d;
using Imath::V3d;

inline constexpr double kTwoPi = 6.283185307179586;
/// Minimum radius, relative to the shape, for the length of dp/du, which would vanish at poles and centers.
inline constexpr double kPoleRadius = 1e-5;

inline const ParamDef<float> kPhiMax{
    "phimax", 360, "sweep about the z axis from the x axis, in degrees, above 0; 360: closed"};

/// Returns "phimax" in radians, in (0, 2π]. Throws a located Error unless it is positive.
inline double sweep(const ParamSet& params) {
    const double degrees = params.get(kPhiMax);
    if (!(degrees > 0))
        throw Error(params.whereIs(kPhiMax), "\"phimax\" must be above 0 degrees");
    return degrees >= 360 ? kTwoPi : degrees / 360 * kTwoPi;
}

/// Returns a parameter that is positive and finite; throws a located Error otherwise.
inline double positive(const ParamSet& params, const ParamDef<float>& def) {
    const float value = params.get(def);
    if (!(value > 0) || !std::isfinite(value))
        throw Error(params.whereIs(def), std::string("\"") + def.name + "\" must be positive and finite");
    return value;
}

/// Returns the cosine and sine of an angle in radians: accurate to float, and of unit length to double.
STROBE_FORCE_INLINE V2d unitVector(double angle) {
    const SinCos s = sinCosOfTurns(float(angle * (1 / kTwoPi)));
    const double cos = s.cos, sin = s.sin;
    const double scale = 1.5 - .5 * (cos * cos + sin * sin); // one Newton step to 1 / length, starting at 1
    return {cos * scale, sin * scale};
}

/// Returns the angle of (x, y) from the x axis in [0, 2π]; the upper limit is float-rounded.
inline float azimuth(float x, float y) {
    const float phi = fastAtan2(y, x);
    return phi < 0 ? phi + float(kTwoPi) : phi;
}

} // namespace strobe
