// The version of strobe.
#pragma once

#include "core/math/api.h"

namespace STROBE_API strobe {

/// Returns "MAJOR.MINOR.PATCH", as in CMakeLists.txt.
const char* version();

} // namespace strobe
