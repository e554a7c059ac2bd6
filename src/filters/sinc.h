// The sinc filter.
#pragma once

#include "core/filter.h"
#include "core/plugin.h"

namespace strobe {

/// "sinc": the sinc function under a Lanczos window. It has negative lobes.
Plugin<std::shared_ptr<const Filter>> sincFilterPlugin();

} // namespace strobe
