// The box filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// "box": constant over the rectangle of the half-widths.
Plugin<std::shared_ptr<const Filter>> boxFilterPlugin();

} // namespace strobe
