// Measured isotropic BRDFs: pbrt-v2's .brdf text files and MERL .binary files; sampled by the cosine and a
// GGX lobe fitted to the file's values.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

Plugin<std::shared_ptr<const Material>> measuredPlugin();

} // namespace strobe
