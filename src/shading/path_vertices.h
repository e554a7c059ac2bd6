// From paths and their hits to a chunk of vertices with BSDFs. Call the functions in the order below; albedos
// need no more than prepareBsdfs.
#pragma once

#include "shading/path_batch.h"
#include "shading/vertex_chunk.h"

namespace strobe {

/// Fills the chunk with the hits of up to kSoAWidth paths, and `missed` with the paths without a hit. Widens
/// the paths' ray cones by the distances to the hits, and sets Path::sampledLightIsDirect. Prefetches the
/// surfaces where meshes are large.
void gatherHits(const Scene& scene, PathBatch& batch, std::span<const uint32_t> paths, VertexChunk& v);

/// Evaluates the surfaces at the hits.
void evaluateSurfaces(const Scene& scene, Counters& counters, VertexChunk& v);

/// Evaluates the BSDFs, and texture footprints where the material needs them.
void prepareBsdfs(Counters& counters, VertexChunk& v);

/// Divides the throughput of paths of LightComponent::Indirect by the albedo of textured materials: see
/// LightComponent. To be called at the first vertex only.
void divideByAlbedo(PathBatch& batch, VertexChunk& v);

/// Applies normal maps, and turns shading normals towards the viewer: see ShadingNormal. The rest is done by
/// completeVertices.
void adjustShadingNormals(const Scene& scene, VertexChunk& v);
/// Writes FirstVertex::emitted of paths, after the light that their camera rays hit was added.
void recordEmission(PathBatch& batch, std::span<const uint32_t> paths);
/// Writes batch.firstVertices of paths whose first non-specular vertex is in the chunk. FirstVertex::direct
/// and `indirect` become the path's radiance before direct and before indirect light; PathBatch::write
/// completes them. Requires completed vertices.
void recordFirstVertices(PathBatch& batch, const VertexChunk& v);

} // namespace strobe
