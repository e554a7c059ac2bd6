// The "measured" material.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// A two-sided isotropic BRDF from a file of measurements: scattered samples in pbrt-v2's text format (.brdf;
/// see IrregularBrdf) or a regular grid of the MERL database (.binary, .merl; see MerlBrdf), with the values
/// of pbrt-v2. pbrt-v2 samples by the cosine only; here directions are sampled by a mixture of the cosine and
/// a GGX lobe fitted to the values (GlossFit). Negative values count as zero.
Plugin<std::shared_ptr<const Material>> measuredPlugin();

} // namespace strobe
