// The baseline: every visibility sample shades for itself.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

IntegratorPlugin supersamplePlugin();

} // namespace strobe
