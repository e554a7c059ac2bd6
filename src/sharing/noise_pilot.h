// A decision before the render: which parts of the light to share.
#pragma once

#include "core/render/integrator.h"
#include "sharing/light_cells.h"

namespace strobe {

/// Renders a pilot of about 2 % of the samples, and shares its light. Returns the parts of the light for
/// which this is predicted to gain more than twice what recording and reconstruction take; none for less than
/// 2 samples per pixel. Depends on the seed and the pixel bounds, not on measured times.
LightParts chooseParts(const Scene& scene, const RenderContext& context, float cellSize);

} // namespace strobe
