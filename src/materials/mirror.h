// A perfect mirror of constant reflectance Kr; no Fresnel term, as in pbrt.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> mirrorPlugin();

} // namespace strobe
