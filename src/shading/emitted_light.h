// The light that the rays of paths hit: emissive surfaces and environment lights.
#pragma once

#include "shading/path_batch.h"
#include "shading/path_settings.h"
#include "shading/vertex_chunk.h"

namespace strobe {

/// Returns the pdf, per solid angle, of light samples of the light at `s`, seen from `p` along `wi` at
/// shutter fraction `time`. The light must not be a delta light.
float lightPdf(const Scene& scene, const SurfacePoint& s, const V3f& p, float time, const V3f& wi);

/// Returns the MIS weight of a light that a light ray of the light tree hit at `s`: as many light samples
/// were taken as light rays. `path` has the vertex that the ray left.
float treeLightRayWeight(const PathContext& context, const Path& path, float bsdfPdf, const SurfacePoint& s,
                         const V3f& wi);

/// Adds the radiance of environment lights to the paths of the chunk without a hit. Weights it by the power
/// heuristic (Veach and Guibas 1995) against the light samples at the vertex that the ray left. `bounce` is
/// that of the chunk's vertices.
void addBackground(const PathContext& context, PathBatch& batch, const VertexChunk& v, int bounce);

/// Adds the emission of the chunk's surfaces to their paths, weighted as by addBackground.
void addEmission(const PathContext& context, PathBatch& batch, const VertexChunk& v, int bounce);

} // namespace strobe
