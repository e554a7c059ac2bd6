// A pilot that measures what a shade costs.
#pragma once

#include "core/render/render_settings.h"
#include "core/render/shader.h"

namespace strobe {

/// Shades what some pixels within `pixelBounds` see, on the calling thread, and returns the cost of a shade.
/// Of `settings`, only the seed matters.
ShadeCost measureShadeCost(const Scene& scene, const Shader& shader, const Sampler& sampler,
                           const Filter& filter, const RenderSettings& settings,
                           const PixelBounds& pixelBounds);

} // namespace strobe
