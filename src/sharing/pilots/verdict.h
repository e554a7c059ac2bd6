// The decision which parts of the light to share, by the errors of blocks of pixels.
#pragma once

#include "sharing/pilots/block_pilot.h"

#include <span>

namespace strobe {

struct Verdict {
    LightParts parts;       ///< to share
    bool isCertain = false; ///< more blocks would hardly change it
};

/// What the pilot of pairs tells about the light.
struct PilotedLight {
    LightParts lit; ///< the parts that are not black
    /// See BlockChooser::gainWithoutIndirect.
    double gainWithoutIndirect = 1;
};

/// Decides by the sum of the roots of the blocks' errors: with the best distribution of samples, the product
/// of error and time is the square of this sum (Neyman allocation, for errors in proportion to 1/n), and a
/// single block does not decide.
///
/// The errors of a block are often those of a few bright samples, and blocks gain less than an image, in
/// which they have neighbors. Where indirect light has much of the noise, sharing gained in all renders that
/// were measured (100 scenes). Such light is shared unless the blocks lose by more than two standard errors,
/// and direct light beside it unless they lose by more than half of one. Where the noise is that of direct
/// light, sharing gains in half of the renders. The blocks must gain by more than one standard error, and
/// their errors, without roots, by half of one.
///
/// `pilots`: at least two. `overhead`: the time of sharing both parts relative to that of the render.
/// `sampleRatio`: in (0, 1]; if less than 1, the render has more samples than the blocks, and gains less.
Verdict decideSharing(std::span<const BlockPilot> pilots, const PilotedLight& light, double overhead,
                      double sampleRatio);

} // namespace strobe
