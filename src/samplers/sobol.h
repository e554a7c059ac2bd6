// The "sobol" sampler, which is the default.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"

namespace strobe {

/// Owen-scrambled low-discrepancy points: every two-dimensional dimension is a (0,2)-sequence (the first two
/// dimensions of Sobol') and every one-dimensional dimension a van der Corput sequence, each scrambled and
/// shuffled independently (Burley, "Practical Hash-based Owen Scrambling", 2020). The pixels of a block of
/// 16x16 pixels take parts of one sequence. The number of samples per pixel is rounded up to a power of two.
/// Also replaces "lowdiscrepancy" and most other samplers of pbrt (samplerAliases).
Plugin<SamplerSetup, int> sobolPlugin();

/// Coordinates as fractions of 2^32.
struct SobolPoint {
    uint32_t x, y;
};
/// Returns point `index` of the unscrambled Sobol' (0,2)-sequence.
SobolPoint sobolPoint(uint32_t index);

} // namespace strobe
