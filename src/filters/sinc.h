// The sinc filter.
#pragma once

#include "core/interfaces/filter.h"
#include "core/params/plugin.h"

namespace strobe {

/// "sinc": the sinc function under a Lanczos window. It has negative lobes.
Plugin<std::shared_ptr<const Filter>> sincFilterPlugin();

} // namespace strobe
