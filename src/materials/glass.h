// A smooth boundary between two dielectrics; outside is the side that the normal points to.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> glassPlugin();

} // namespace strobe
