// The triangle filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// "triangle": a tent along each axis, falling to zero at the half-width.
Plugin<std::shared_ptr<const Filter>> triangleFilterPlugin();

} // namespace strobe
