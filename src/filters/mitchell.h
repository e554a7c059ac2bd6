// The "mitchell" filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// The piecewise cubic of Mitchell and Netravali ("Reconstruction Filters in Computer Graphics", 1988) with
/// parameters B and C along each axis, scaled to the half-widths. It has negative lobes.
Plugin<std::shared_ptr<const Filter>> mitchellFilterPlugin();

} // namespace strobe
