// Owen-scrambled (0,2) points: the default sampler.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"

namespace strobe {

/// "sobol" (pbrt: "lowdiscrepancy" and most other names): every two-dimensional dimension is an independently
/// Owen-scrambled and shuffled (0,2)-sequence, and every one-dimensional one a van der Corput sequence.
Plugin<SamplerSetup, int> sobolPlugin();

/// Coordinates of point `index` of the unscrambled Sobol' (0,2)-sequence, as fractions of 2^32.
struct SobolPoint {
    uint32_t x, y;
};
SobolPoint sobolPoint(uint32_t index);

} // namespace strobe
