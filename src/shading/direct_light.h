// Next-event estimation with multiple importance sampling.
#pragma once

#include "shading/path_batch.h"
#include "shading/path_settings.h"
#include "shading/ray_queues.h"

#include <array>

namespace strobe {

/// Samples `first` … `first + count - 1` of the `total` samples that each vertex takes.
struct VertexSamples {
    int first = 0, count = 1, total = 1;
};

/// Calls work(vertices, samples) for groups of at most kSoAWidth samples.
template <class Work>
void forSampleGroups(std::span<const int32_t> vertices, int samplesPerVertex, const Work& work) {
    const size_t groupSize = size_t(std::max(1, kSoAWidth / samplesPerVertex));
    for (size_t i = 0; i < vertices.size(); i += groupSize) {
        const auto group = vertices.subspan(i, std::min(groupSize, vertices.size() - i));
        for (int first = 0; first < samplesPerVertex; first += kSoAWidth)
            work(group,
                 VertexSamples{first, std::min(samplesPerVertex - first, kSoAWidth), samplesPerVertex});
    }
}

/// The arguments of Sampler::fill1D and fill2D for samples at vertices of a chunk, vertex by vertex: at most
/// kSoAWidth samples.
class VertexSampleRanges {
  public:
    VertexSampleRanges(const PathBatch& batch, const VertexChunk& v, std::span<const int32_t> vertices,
                       const VertexSamples& samples = {});
    operator std::span<const SampleRange>() const { return std::span(m_ranges).first(m_count); }

  private:
    std::array<SampleRange, kSoAWidth> m_ranges;
    size_t m_count;
};

/// A BSDF sample of direct light that is traced to find out whether it hits the light.
struct LightRay {
    uint32_t path;
    int light;     ///< -1: any light, with the MIS weight of the light tree
    float bsdfPdf; ///< per solid angle; there are as many light samples as light rays
    V3f p, wi;     ///< the vertex, and the direction
    float time;
    Rgb weight; ///< beta f |cos| / (n pdf)
};

/// Adds the contributions of visible shadow rays to their paths.
struct AddVisibleLight {
    PathBatch& batch;
    void operator()(const ShadowPacket& packet) const;
};

/// Adds the light that a light ray hit, weighted by the power heuristic.
struct AddLightRay {
    const PathContext& context;
    PathBatch& batch;
    void operator()(const LightRay& ray, const Hit& hit) const;

  private:
    void addBackground(const LightRay& ray) const;
};

/// Direct light of the vertices of a batch's paths. Each vertex takes samples of all lights, of one light
/// chosen by power, or of lights chosen by the light tree. Where usesMis holds, light samples are combined
/// with BSDF samples by the power heuristic (Veach and Guibas, "Optimally Combining Sampling Techniques for
/// Monte Carlo Rendering", 1995). The path's next ray is the BSDF sample; where the path ends, there are as
/// many light rays as light samples.
class DirectLight {
  public:
    DirectLight(const PathContext& context, PathBatch& batch);

    /// Samples the direct light of the chunk's vertices and adds the rays to queues, whose full packets are
    /// traced at once. Sets Path::sampledAllLights. `bounce` is the bounce of the vertices.
    void sample(VertexChunk& v, int bounce);
    /// Traces the remaining rays of a wave and counts its shadow and light rays. The batch's active paths
    /// then hold the wave's direct light.
    void finishWave();

  private:
    /// An estimate of the direct light of one light.
    struct LightEstimate {
        const Light& light;
        int index;            ///< into Scene::lights
        int samples;          ///< per vertex
        float probability;    ///< of choosing the light
        uint32_t dimension;   ///< the light's first random dimension
        bool usesMis = false; ///< at any of the vertices

        float expectedSamples() const { return float(samples) * probability; }
    };

    void sampleOneLight(VertexChunk& v, std::span<const int32_t> vertices, int bounce);
    void sampleLight(VertexChunk& v, std::span<const int32_t> vertices, int light, int samples,
                     float probability, int bounce);
    bool countBsdfSamples(const VertexChunk& v, std::span<const int32_t> vertices, const LightEstimate& e);
    void addShadowRays(VertexChunk& v, std::span<const int32_t> vertices, const VertexSamples& samples,
                       const LightEstimate& e);
    void addLightRays(VertexChunk& v, std::span<const int32_t> vertices, const LightEstimate& e);
    void addLightRayGroup(VertexChunk& v, std::span<const int32_t> vertices, const VertexSamples& samples,
                          const LightEstimate& e);
    bool sampleBsdfs(const VertexChunk& v, const VertexSoA& origins, std::span<const int32_t> vertices,
                     const VertexSamples& samples, const LightEstimate& e);
    void drawBsdfs(const VertexChunk& v, const VertexSoA& origins, std::span<const int32_t> vertices,
                   const VertexSamples& samples, uint32_t dimension);

    // Direct light by the light tree: direct_light_tree.cpp.
    void sampleTree(VertexChunk& v, std::span<const int32_t> vertices, int samples, int bounce);
    void addTreeShadowRays(VertexChunk& v, std::span<const int32_t> vertices, const VertexSamples& samples,
                           int bounce);
    bool sampleEmitters(const VertexChunk& v, const VertexSoA& origins);
    void addTreeLightRays(VertexChunk& v, std::span<const int32_t> vertices, const VertexSamples& samples,
                          int bounce);

    const PathContext& m_context;
    PathBatch& m_batch;
    ShadowRayQueue<AddVisibleLight> m_shadowRays;
    NearestHitQueue<LightRay, AddLightRay> m_lightRays;
    bool m_hasLightRays = false; ///< in this wave

    // Scratch of `sample`:
    LightSampleChunk m_lightSamples;
    LightRayChunk m_bsdfSamples;
    LightPickSoA m_picks;
    alignas(64) float m_bsdfSampleCount[kSoAWidth]; ///< by vertex: number of BSDF samples to combine with
};

} // namespace strobe
