// The "stratified" sampler.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"

namespace strobe {

/// xsamples * ysamples jittered strata per pixel. Two-dimensional points are correlated multi-jittered: they
/// also have one point in each of `total` strata along either axis (Kensler, "Correlated Multi-Jittered
/// Sampling", 2013).
Plugin<SamplerSetup, int> stratifiedPlugin();

/// Returns element `index` of a random permutation of 0 … n-1 that depends on `seed`, without tables.
uint32_t permutedIndex(uint32_t index, uint32_t n, uint64_t seed);

} // namespace strobe
