// The mitchell filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// "mitchell": Mitchell and Netravali's cubic (1988) with parameters B and C, stretched to the half-width. It
/// has negative lobes.
Plugin<std::shared_ptr<const Filter>> mitchellFilterPlugin();

} // namespace strobe
