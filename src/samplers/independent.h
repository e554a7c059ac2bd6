// The "independent" sampler.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"

namespace strobe {

/// Independent uniform random numbers: each is a hash of (domain, dimension, index). Also known as "random"
/// (pbrt).
Plugin<SamplerSetup, int> independentPlugin();

} // namespace strobe
