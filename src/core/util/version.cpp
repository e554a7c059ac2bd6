#include "core/util/version.h"

namespace strobe {

const char* version() { return STROBE_VERSION; }

} // namespace strobe
