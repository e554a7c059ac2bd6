// The "gaussian" filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// The Gaussian exp(-alpha x²) (pbrt-v2 and v3) or exp(-x² / (2 sigma²)) (pbrt-v4) along each axis, minus its
/// value at the half-width, where the filter is 0. Offsets are in pixels.
Plugin<std::shared_ptr<const Filter>> gaussianFilterPlugin();

} // namespace strobe
