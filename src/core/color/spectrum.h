// Spectra to linear RGB, as pbrt's RGB mode converts them.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace strobe {

/// Linear (Rec. 709) RGB of a sampled spectrum: sums against the CIE 1931 2° curves over 360..830 nm in steps
/// of 1 nm, divided by the sum of Y, and through pbrt's XYZ matrix. There is no white balance: a flat 1
/// becomes (1.205, .948, .909). `wavelengths` (nm) must ascend strictly and be as many as `values`, at least
/// one; values are interpolated linearly in between and held beyond the ends.
Rgb spectrumToRgb(std::span<const float> wavelengths, std::span<const float> values);

/// A black body of `kelvin` degrees, normalized as in pbrt-v4: the peak of its Planck spectrum (wherever it
/// lies) is `scale`. (pbrt-v2 gives the unnormalized radiance.) Zero and negative temperatures are black.
Rgb blackbodyRgb(float kelvin, float scale);

/// Reads a spectrum file: lines of a wavelength (nm) and a value; # starts a comment. `where` is the
/// parameter that names the file. Throws a located Error for an unreadable, empty, malformed or unordered
/// file.
Rgb readSpd(const std::filesystem::path& path, const Location& where);

/// pbrt-v4's named spectra: "metal-Cu-eta" and "-k" (also Ag, Al, Au) and "glass-BK7", "-BAF10", "-FK51A",
/// "-LASF9", "-SF5", "-SF10", "-SF11", "-F5", "-F10", "-F11". Unlike spectrumToRgb these are divided by the
/// RGB of a flat spectrum, since v4 renders spectra: a gray index stays gray. Glasses are their index at
/// 587.6 nm. Illuminants, "stdillum-A", "-D50", "-D65" and "-F1" to "-F12", have luminance 1; D65 is white.
std::optional<Rgb> namedSpectrum(const std::string& name);

} // namespace strobe
