// A stochastic mix of two materials.
#pragma once

#include "core/interfaces/material.h"

namespace strobe {

/// Creates a material that is `second` with probability `amount` (clamped to 0 to 1) at each point, else
/// `first`, as in pbrt-v4. The choice is a hash of the position and of `salt`, which should differ between
/// mixes.
std::shared_ptr<const Material> makeMix(std::shared_ptr<const Material> first,
                                        std::shared_ptr<const Material> second, FloatInput amount,
                                        uint32_t salt);

} // namespace strobe
