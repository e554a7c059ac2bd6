// The decision which parts of the light to share, by the errors of blocks of pixels.
#pragma once

#include "sharing/pilots/block_pilot.h"

#include <span>

namespace strobe {

struct Verdict {
    LightParts parts;       ///< to share
    bool isCertain = false; ///< more blocks would hardly change it
};

/// The parts of the light, as the pilot of pairs measured them.
struct PilotedLight {
    LightParts lit; ///< the parts that are not black
    /// See BlockChooser::gainWithoutIndirect.
    double gainWithoutIndirect = 1;
};

/// Decides by the sum of the roots of the blocks' errors. With the best distribution of samples, the product
/// of error and time is the square of this sum (Neyman allocation, for errors in proportion to 1/n). A single
/// block does not decide. Blocks gain less than an image, because they have no neighbors.
///
/// - Indirect light with at least a sixth of the noise gains in nearly every scene that was measured. It is
///   shared unless the blocks lose by more than two standard errors.
/// - Other light gains in about half of the renders. It is shared if the blocks gain by more than one
///   standard error, and if the sum of their errors, without roots, gains by more than half of one.
/// - Direct light is shared beside indirect light unless the blocks lose by more than half of a standard
///   error.
///
/// `pilots`: at least two. `overhead`: the time of sharing both parts relative to that of the render.
/// `sampleRatio`: in (0, 1]; if less than 1, the render has more samples than the blocks, and gains less.
Verdict decideSharing(std::span<const BlockPilot> pilots, const PilotedLight& light, double overhead,
                      double sampleRatio);

} // namespace strobe
