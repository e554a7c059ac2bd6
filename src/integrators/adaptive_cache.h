// Shares light as far as it reduces the error, and takes more samples where noise is.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

/// Renders the samples of `supersample`, and more in blocks of pixels in which a pilot finds noise. At the
/// end, it mixes each pixel's own light with estimates from neighboring samples on the same surfaces,
/// weighted by their measured errors.
IntegratorPlugin adaptiveCachePlugin();

} // namespace strobe
