// Iridescence: interference of light in a thin film.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// Returns the reflectance of a base under a thin film of dielectric in air. `cosine`: |cosine| of the angle
/// of incidence; `index` of the film, at least 1; `thickness` in nanometers; `f0`: reflectance of the base in
/// air at normal incidence. The Airy sum over wavelengths, averaged with the color matching functions, as
/// proposed by Belcour and Barla ("A Practical Extension to Microfacet Theory for the Modeling of Varying
/// Iridescence", 2017); the reflectance of the base is Schlick's.
Rgb thinFilmReflectance(float cosine, float index, float thickness, const Rgb& f0);

} // namespace strobe
