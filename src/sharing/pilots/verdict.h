// The decision which parts of the light to share, by the errors of blocks of pixels.
#pragma once

#include "sharing/pilots/block_pilot.h"
#include "sharing/pilots/sharing_plan.h"

#include <span>

namespace strobe {

/// The overhead of both parts.
struct Overheads : SharingOverhead {
    bool adapts; ///< whether the numbers of samples may differ
    double least() const { return adapts ? adaptive : uniform; }
};

struct Verdict {
    LightParts parts; ///< to share
    /// The verdict hardly depends on the choice of the blocks, or it refuses direct light alone because the
    /// blocks lose by it on average. Of 11 such refusals, twice as many blocks changed none.
    bool isCertain = true;
};

/// Decides for the parts whose sharing leaves the least error, by the first of kErrorClips for which this
/// pays: for which the error per time falls by more than a fifth, and by more than half of the standard error
/// of the blocks' sum. If there is none, the roots of the errors decide about indirect light, so that a
/// single block does not: with the best distribution of samples, the product of error and time is the square
/// of their sum (Neyman allocation, for errors in proportion to 1/n; those of direct light fall faster). They
/// need no margin, as blocks without neighbors gain less than the image, but a whole standard error where
/// samples do not adapt.
///
/// `pilots`: at least two. `lit`: the parts that are not black. `gainLeft`: the part of the blocks' gain
/// above 1 that is left in the render, which has more samples.
Verdict decideSharing(std::span<const BlockPilot> pilots, LightParts lit, const Overheads& overheads,
                      double gainLeft);

} // namespace strobe
