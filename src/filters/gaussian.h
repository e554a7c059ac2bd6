// The gaussian filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// "gaussian": exp(-alpha x²) (pbrt-v2, v3) or a normal distribution of standard deviation sigma (v4),
/// lowered so that it reaches zero at the half-width.
Plugin<std::shared_ptr<const Filter>> gaussianFilterPlugin();

} // namespace strobe
