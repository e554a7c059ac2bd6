// The material of docs/tutorial-material.md.
#pragma once

#include "core/interfaces/material.h"
#include "core/params/plugin.h"

namespace strobe {

/// Diffuse reflection that darkens towards the silhouette, as velvet seen against its pile (M. Minnaert, "The
/// Reciprocity Principle in Lunar Photometry", 1941): f = Kd (k+1)/(2π) (cosθi cosθo)^(k-1). Lambertian for
/// an exponent k of 1. Two-sided.
Plugin<std::shared_ptr<const Material>> minnaertPlugin();

} // namespace strobe
