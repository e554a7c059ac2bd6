// The decision which parts of the light to share, by the errors of blocks of pixels.
#pragma once

#include "sharing/pilots/block_pilot.h"

#include <span>

namespace strobe {

struct Verdict {
    LightParts parts;       ///< to share
    bool isCertain = false; ///< more blocks would hardly change it
};

/// Decides by the sum of the roots of the blocks' errors: with the best distribution of samples, the product
/// of error and time is the square of this sum (Neyman allocation, for errors in proportion to 1/n), and a
/// single block does not decide.
///
/// The errors of a block are those of a few bright samples, often, and blocks gain less than an image, in
/// which they have neighbors. In 130 renders with indirect light, sharing always had less error than
/// refusing it, but for three of equal errors. Therefore indirect light is shared unless the blocks lose by
/// more than two standard errors, and direct light beside it unless they lose by more than half of one.
/// Direct light alone gains in half of the renders. It is shared if the blocks gain by more than half of a
/// standard error, and their errors, without roots, gain on average.
///
/// `pilots`: at least two. `lit`: the parts that are not black. `overhead`: the time of sharing both parts
/// relative to that of the render. `gainLeft`: the part of the blocks' gain above 1 that is left in the
/// render, which has more samples.
Verdict decideSharing(std::span<const BlockPilot> pilots, LightParts lit, double overhead, double gainLeft);

} // namespace strobe
