// The "mirror" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// A two-sided perfect mirror of reflectance Kr at all angles: like pbrt-v2's, it has no Fresnel term.
Plugin<std::shared_ptr<const Material>> mirrorPlugin();

} // namespace strobe
