// Pilots: renders of a few pixels whose image is discarded.
#pragma once

#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/render/render_settings.h"
#include "core/render/shader.h"

namespace STROBE_API strobe {

/// Shades the hits of a few random pixels within `pixelBounds` on the calling thread, and returns the cost of
/// a shade. Of `settings`, only the seed is used.
ShadeCost measureShadeCost(const Scene& scene, const Shader& shader, const Sampler& sampler,
                           const Filter& filter, const RenderSettings& settings,
                           const PixelBounds& pixelBounds);

/// See MakePilotRenderer. All arguments outlive the renderer.
std::unique_ptr<PilotRenderer> makePilotRenderer(const Scene& scene, IntegratorState& state,
                                                 const Shader& shader, const Sampler& sampler,
                                                 const Filter& filter, int samplesPerPixel);

} // namespace strobe
