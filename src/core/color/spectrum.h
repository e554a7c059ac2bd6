// Conversion of spectra to linear RGB, as in the RGB mode of pbrt.
#pragma once

#include "core/math/api.h"
#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace STROBE_API strobe {

/// Returns the linear Rec. 709 RGB of a sampled spectrum. The spectrum is integrated against the CIE 1931 2°
/// color matching functions from 360 to 830 nm in steps of 1 nm, divided by the integral of ȳ, and converted
/// with pbrt's XYZ matrix. There is no white balance: a constant spectrum of 1 becomes (1.205, .948, .909).
/// `wavelengths` (nm) must ascend strictly; there must be as many as `values`, and at least one (else throws
/// Error). Values are interpolated linearly, and constant beyond the ends.
Rgb spectrumToRgb(std::span<const float> wavelengths, std::span<const float> values);

/// Returns the RGB of a blackbody at temperature `kelvin`, normalized as in pbrt-v4: the maximum of its
/// Planck spectrum, at any wavelength, is `scale`. (pbrt-v2 does not normalize the radiance.) Returns black
/// for temperatures <= 0.
Rgb blackbodyRgb(float kelvin, float scale);

/// Reads a spectrum file and returns spectrumToRgb of its samples. Each line has a wavelength (nm) and a
/// value; # starts a comment. Throws Error at `where`, the parameter with the file name, if the file is
/// unreadable, empty or malformed, or the wavelengths do not ascend.
Rgb readSpd(const std::filesystem::path& path, const Location& where);

/// Returns the RGB of a named spectrum of pbrt-v4; nothing if the name is unknown.
/// - Metals: "metal-Cu-eta" and "metal-Cu-k", also for Ag, Al, Au, CuZn, MgO and TiO2. Unlike spectrumToRgb,
/// divides by the
///   RGB of a constant spectrum, so that a gray index of refraction stays gray, as in the spectral rendering
///   of pbrt-v4.
/// - Glasses: "glass-BK7", "-BAF10", "-FK51A", "-LASF9", "-SF5", "-SF10", "-SF11", "-F5", "-F10", "-F11". The
///   value is the index of refraction at 587.6 nm.
/// - Illuminants: "stdillum-A", "-D50", "-D65" and "-F1" to "-F12", and "illum-acesD60", with luminance 1;
/// D65 is
///   white.
std::optional<Rgb> namedSpectrum(const std::string& name);

} // namespace strobe
