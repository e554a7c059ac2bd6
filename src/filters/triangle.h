// The "triangle" filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// A tent along each axis, which is 0 at the half-width.
Plugin<std::shared_ptr<const Filter>> triangleFilterPlugin();

} // namespace strobe
