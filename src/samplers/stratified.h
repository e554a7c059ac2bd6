// Stratified (correlated multi-jittered) samples.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"

namespace strobe {

/// "stratified": xsamples * ysamples jittered strata per pixel. Two-dimensional points also fall one into
/// each of `total` strata along either axis (Kensler, "Correlated Multi-Jittered Sampling", 2013).
Plugin<SamplerSetup, int> stratifiedPlugin();

/// The member at place `index` of a random permutation of 0 … n-1, chosen by `seed`; without tables.
uint32_t permutedIndex(uint32_t index, uint32_t n, uint64_t seed);

} // namespace strobe
