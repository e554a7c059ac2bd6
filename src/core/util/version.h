// The version of strobe.
#pragma once

namespace strobe {

/// Returns "MAJOR.MINOR.PATCH", as in CMakeLists.txt.
const char* version();

} // namespace strobe
