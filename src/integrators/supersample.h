// The baseline: every visibility sample shades for itself.
#pragma once

#include "core/render/integrator.h"

namespace strobe {

using IntegratorPlugin = Plugin<std::shared_ptr<const Integrator>>;

IntegratorPlugin supersamplePlugin();

} // namespace strobe
