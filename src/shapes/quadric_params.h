// What the quadrics share: their sweep angle and the checks of their lengths.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/fast_math.h"
#include "core/params/plugin.h"

namespace strobe {

using Imath::V2d;
using Imath::V3d;

inline constexpr double kTwoPi = 6.283185307179586;
/// Relative radius within which dp/du is that of this radius: it vanishes at poles and centers.
inline constexpr double kPoleRadius = 1e-5;

inline const ParamDef<float> kPhiMax{"phimax", 360, "how far the shape goes about the z axis, in degrees"};

/// "phimax" in radians, in (0, 2 pi].
inline double sweep(const ParamSet& params) {
    const double degrees = params.get(kPhiMax);
    if (!(degrees > 0))
        throw Error(params.whereIs(kPhiMax), "\"phimax\" must be above 0 degrees");
    return degrees >= 360 ? kTwoPi : degrees / 360 * kTwoPi;
}

/// A length that must be above 0 and finite.
inline double positive(const ParamSet& params, const ParamDef<float>& def) {
    const float value = params.get(def);
    if (!(value > 0) || !std::isfinite(value))
        throw Error(params.whereIs(def), std::string("\"") + def.name + "\" must be positive and finite");
    return value;
}

/// Cosine and sine of an angle: to the precision of floats, but of unit length to that of doubles.
STROBE_FORCE_INLINE V2d unitVector(double angle) {
    const SinCos s = sinCosOfTurns(float(angle * (1 / kTwoPi)));
    const double cos = s.cos, sin = s.sin;
    const double scale = 1.5 - .5 * (cos * cos + sin * sin); // Newton's step to 1 over the length, from 1
    return {cos * scale, sin * scale};
}

/// The angle of (x, y) from the x axis, in [0, 2 pi], as a float of the latter may round.
inline float azimuth(float x, float y) {
    const float phi = fastAtan2(y, x);
    return phi < 0 ? phi + float(kTwoPi) : phi;
}

} // namespace strobe
