// Film layers as pictures for people.
#pragma once

#include "core/film/film.h"

namespace strobe {

/// The layer in false color, with its scale below: counts from blue (1) to red (`samplesPerPixel`) in
/// logarithmic steps, 0 black; fractions from blue (0) to red (1), absent ones black; blocks in colors of
/// their own, without a scale. Linear RGB, as writePng takes it.
Image heatmap(const Film& film, Aov layer, int samplesPerPixel);

} // namespace strobe
