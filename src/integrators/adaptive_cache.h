// Shares indirect light as far as it reduces the error.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

/// Renders the samples of `supersample`. At the end, it mixes each pixel's own indirect light with estimates
/// from neighboring samples on the same surfaces, weighted by their measured errors.
IntegratorPlugin adaptiveCachePlugin();

} // namespace strobe
