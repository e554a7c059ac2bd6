// The integrator of docs/tutorial-integrator.md: neighboring pixels share shades.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

/// Visibility samples in the same square of `size` x `size` pixels that hit the same primitive share a shade.
/// Biased.
IntegratorPlugin quadPlugin();

} // namespace strobe
