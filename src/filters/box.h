// The "box" filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// Constant over the rectangle given by the half-widths, sampled uniformly.
Plugin<std::shared_ptr<const Filter>> boxFilterPlugin();

} // namespace strobe
