// The baseline: one shade per visibility sample.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

IntegratorPlugin supersamplePlugin();

} // namespace strobe
