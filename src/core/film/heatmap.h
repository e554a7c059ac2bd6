// False-color images of the film's layers.
#pragma once

#include "core/film/film.h"
#include "core/math/api.h"

namespace STROBE_API strobe {

/// Returns a false-color image of a layer, in linear RGB, with a color bar and the name of the layer and of
/// its scale below. Counts (Aov::Shades and Aov::Samples) are shown on a logarithmic scale from blue (1) to
/// red (`samplesPerPixel`, or the largest count if that is more), zero in black; fractions on a linear scale
/// from blue (0) to red (1), negative values in black. Aov::Cell has a hashed color per id, zero in black,
/// and no color bar.
Image heatmap(const Film& film, Aov layer, int samplesPerPixel);

} // namespace strobe
