// A decision before the render: which parts of the light to share.
#pragma once

#include "sharing/emission/emission_refinement.h"
#include "sharing/pilots/pair_pilot.h"

#include <optional>

namespace strobe {

/// An estimate of the time for recording and reconstruction relative to that of the render.
struct SharingOverhead {
    double uniform = 0;  ///< if all pixels have the same number of samples
    double adaptive = 0; ///< if their numbers differ (planSamples), which is less
};

/// How the light of a render is shared.
struct SharingPlan {
    LightParts parts;         ///< the parts of the light to share
    SharingOverhead overhead; ///< 0 if nothing is shared
    RareLimits rareLimits;
    std::optional<EmissionPilot> emission; ///< none: EmissionRefinement would gain little
};

/// Renders blocks of pixels, usually less than 1 % of the samples, and reconstructs their light. Their errors
/// decide which parts are shared (decideSharing). Blocks with more noise in `pairs` are chosen with a larger
/// probability (BlockChooser). `chosen`: the parts to share in any case. `adaptsSamples`: planSamples
/// follows. At least 2 samples per pixel. The result does not depend on the seed, on slices of the samples or
/// on measured times.
SharingPlan planSharing(const Scene& scene, const RenderContext& context, const PairPilot& pairs,
                        float cellSize, const std::optional<LightParts>& chosen, bool adaptsSamples);

} // namespace strobe
