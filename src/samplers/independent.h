// Independent uniform random numbers.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"

namespace strobe {

/// "independent" (pbrt also: "random"): each number a hash of (domain, dimension, index).
Plugin<SamplerSetup, int> independentPlugin();

} // namespace strobe
