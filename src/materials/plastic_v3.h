// The plastic of pbrt-v3: a diffuse lobe plus a GGX lobe. Not a plugin of its own: .pbrt files of v3 use it.
#pragma once

#include "core/params/params.h"

#include <memory>

namespace strobe {

class Material;

/// Creates the material. Its lobe depends on the side of the surface: on the outside, the Fresnel term is
/// that of light from inside the dielectric, 1 beyond 41.8° from the half vector; scenes are tuned to it.
/// `kd`: diffuse reflectance; `ks`: scale of the glossy lobe; `alpha`: of GGX, limited to [.001, 1].
std::shared_ptr<const Material> makePlasticV3(RgbInput kd, RgbInput ks, FloatInput alpha);

} // namespace strobe
