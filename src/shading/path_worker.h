// The path tracer.
#pragma once

#include "shading/direct_light.h"

namespace strobe {

/// Traces the paths of a batch in waves: each wave extends all active paths by one vertex. The vertices of a
/// wave are processed in chunks of up to kSoAWidth, sorted by material.
class PathWorker : public ShaderWorker {
  public:
    PathWorker(const Scene& scene, const Sampler& sampler, const PathSettings& settings,
               const LightComponents& lightComponents);
    void shade(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters) override;

  private:
    /// Sets the hit of a path's next ray.
    struct SetHit {
        PathBatch& batch;
        void operator()(uint32_t path, const Hit& hit) const { batch.setHit(path, hit); }
    };

    void shadeAlbedos();
    size_t continuingPaths(int bounce);
    void traceWave(int bounce);
    void prepareVertices(int bounce);
    void spawnRays(int bounce);
    void sampleBsdfs(const VertexSampleRanges& ranges, int bounce);

    const PathContext m_context;
    PathBatch m_batch;
    VertexChunk m_vertices;
    BsdfSampleChunk m_bsdfSamples; ///< the next rays of the chunk's paths
    DirectLight m_directLight;
    NearestHitQueue<uint32_t, SetHit> m_nextRays; ///< by path
};

} // namespace strobe
