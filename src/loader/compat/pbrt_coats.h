// Bases below a smooth dielectric coat: the light that bounces between base and coat.
#pragma once

#include "core/params/params.h"

namespace strobe {

/// Returns a diffuse base as it appears through a coat, apart from the light that the coat reflects: light
/// bounces between the base and the inside of the coat, which reflects most of it. With the total
/// transmittance T = (1 - Fe) / eta² of diffuse light from inside, this is rho T / (1 - rho (1 - T)); Fe is
/// the reflectance of the coat for diffuse light from outside.
RgbInput belowCoat(const RgbInput& reflectance, float eta);

/// As belowCoat, for a conductor: a mirror sends light back at the angle of transmission, where the coat
/// reflects as from outside; a rough conductor scatters it as a diffuse base does. `alpha`: of the conductor.
RgbInput conductorBelowCoat(const RgbInput& reflectance, float eta, float alpha);

} // namespace strobe
