// The sheen of cloth.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// The alpha of a sheen of the given roughness, in [0,1]. Sheen below a roughness of 0.07 is as at 0.07.
inline float sheenAlpha(float roughness) { return sqr(std::max(roughness, .07f)); }

/// Returns the albedo of a white sheen for a direction, at most 1. `roughness` in [0,1].
float sheenAlbedo(float cosine, float roughness);

/// Returns the BRDF of a white sheen: the distribution of Estevez and Kulla ("Production Friendly Microfacet
/// Sheen BRDF", 2017) with the visibility term of Neubelt and Pettineo ("Crafting a Next-Gen Material
/// Pipeline for The Order: 1886", 2013), as in KHR_materials_sheen. Divided by its albedo at either direction
/// where that exceeds 1. `cosO`, `cosI` > 0; `cosHalf`: of the half vector to the normal.
float sheenBrdf(float cosO, float cosI, float cosHalf, float roughness);

} // namespace strobe
