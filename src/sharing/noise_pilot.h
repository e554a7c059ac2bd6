// A decision before the render: which parts of the light to share.
#pragma once

#include "core/render/integrator.h"
#include "sharing/emission_refinement.h"

#include <optional>

namespace strobe {

/// How the light of a render is shared.
struct SharingPlan {
    LightParts parts; ///< the parts of the light to share; empty: the render equals that of supersample
    RareLimits rareLimits;
    EmissionPilot emission;
};

/// Renders a pilot of about 1 % of the samples and reconstructs its light. The parts to share are those that
/// leave the least error, or none if they do not gain clearly more than recording and reconstruction cost.
/// Less than 2 samples per pixel: none. `chosen`: the parts to share in any case. The result depends on the
/// scene, on context.pilotBounds and on the number of samples, but not on the seed, on slices of the samples
/// or on measured times.
SharingPlan planSharing(const Scene& scene, const RenderContext& context, float cellSize,
                        const std::optional<LightParts>& chosen);

} // namespace strobe
