// The automatic exposure of glTF files, and warnings about images in which little is to be seen.
#pragma once

#include "core/render/render.h"
#include "session/frame.h"

namespace strobe {

/// Whether the exposure of images with a view (PNG, JPEG, TIFF) is automatic: all scene files are glTF files,
/// their own lights are the only ones, the options set no exposure, and there is such an image.
bool hasAutomaticExposure(const RenderOptions& options, const FrameSetup& setup);

/// Returns an exposure, in stops, from a few samples of evenly spaced rows of the full frame: it brings the
/// median of the luminances that are not black to 0.25, but no more than 5 % of them above 1. A multiple of
/// 0.25. Does not depend on crop windows, threads or the seed. 0 if all samples are black.
float automaticExposure(const BuiltScene& built);

/// Warns if the image of a glTF file shows no surface, or is nearly black or nearly white.
void reportVisibility(const Film& film, const RenderStats& stats, const FrameJob& job,
                      const BuiltScene& built, const Log& log);

} // namespace strobe
