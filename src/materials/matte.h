// Lambertian (Kd), or Oren and Nayar's rough diffuse when sigma (degrees) is not zero.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> mattePlugin();

} // namespace strobe
