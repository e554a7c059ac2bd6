// Perlin's gradient noise and sums of its octaves.
#pragma once

#include "core/math/math.h"
#include "core/params/params.h"

namespace strobe {

/// Returns gradient noise (Perlin, "Improving Noise", 2002): about -1 to 1, 0 at integer points, with a mean
/// of 0 and a period of 256 in each coordinate. Not finite where `p` is not.
float noise(const V3f& p);

/// The octaves of fbm and turbulence. Octave k has the frequency 1.99^k and the weight `roughness`^k.
struct Octaves {
    int count;       ///< the largest number of octaves
    float roughness; ///< of the weights; pbrt's omega
};

inline const ParamDef<int> kOctaves{"octaves", 8, "number of octaves, at most 32"};
inline const ParamDef<float> kOctaveRoughness{"roughness", .5f,
                                              "weight of an octave relative to the previous one"};
/// Reads both parameters. Throws a located Error if there are less than 0 or more than 32 octaves.
Octaves readOctaves(const ParamSet& params);

/// Returns the sum of octaves of noise. Octaves above the Nyquist frequency of a footprint of `width` fade
/// out, as in pbrt.
float fbm(const V3f& p, float width, const Octaves& octaves);
/// Returns the sum of the magnitudes of octaves of noise. Octaves above the Nyquist frequency of the
/// footprint are replaced by their mean.
float turbulence(const V3f& p, float width, const Octaves& octaves);

} // namespace strobe
