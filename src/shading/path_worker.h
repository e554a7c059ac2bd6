// The path tracer at work: waves of vertices, kSoAWidth of them side by side.
#pragma once

#include "shading/path_state.h"
#include "shading/ray_queues.h"
#include "shading/vertex_soa.h"

#include <array>

namespace strobe {

class PathWorker : public ShaderWorker {
  public:
    PathWorker(const Scene& scene, const Sampler& sampler, const ShadeSettings& settings,
               const LightComponents& lightComponents);
    void shade(const ShadingRequests& requests, std::span<Rgb> radiance, Counters& counters) override;

  private:
    static constexpr int kBuckets = 64; ///< of paths, by material

    void start(const ShadingRequests& requests);
    void wave();
    void meet(uint32_t path, const Hit& hit);
    void sortByMaterial(std::vector<uint32_t>& paths);

    // One chunk of vertices (path_vertices.cpp):
    void load(std::span<const uint32_t> paths);
    void prefetch(std::span<const uint32_t> paths) const;
    void gather(uint32_t index, Path& path, int i);
    void prepare(bool forLight);
    void findFootprints(const Material& material, int begin, int end);
    void divideByAlbedo(const Material& material, int begin, int end);
    void adjustNormal(int i, const TextureQuery& q);
    void addAlbedos();
    /// Without a footprint.
    static TextureQuery queryAt(const SurfacePoint& s, const Hit& hit);
    void addEnvironment(std::span<const uint32_t> paths);
    void addEmission(uint32_t path, RawSurfacePoint s);
    template <class LightPdf>
    float foundWeight(const Path& path, int index, const LightPdf& lightPdf) const;
    bool usesBsdfSampling(const Light& light, const V3f& p, float time, float maxPdf) const;

    // Its direct light (path_lights.cpp):
    void addDirect();
    void addPicked(const int32_t* vertices, int count);
    void addLight(const int32_t* vertices, int count, int lightIndex, int n, float picked);
    bool findBsdfShares(const int32_t* vertices, int count, const Light& light, float n);
    void sendLightSamples(const int32_t* vertices, int count, int lightIndex, int first, int drawn, int n,
                          float picked, bool weighs);
    const VertexRows& rowsOf(const int32_t* vertices, int count, int times);
    void addVisible(const ShadowAnswers& answers);
    void addBsdfSamples(const int32_t* vertices, int count, int lightIndex, int n, float picked);
    void sendBsdfSamples(const int32_t* vertices, int count, int lightIndex, int first, int drawn, int n,
                         float picked);
    bool drawToLight(const VertexRows& at, const Light& light, uint32_t dim, const int32_t* vertices,
                     int count, int first, int drawn, int n);
    void finishProbe(const LightProbe& probe, const Hit& hit);

    // Its next rays:
    void extend();
    void drawDirections(const int32_t* vertices, int count);
    bool survivesRoulette(Path& path, float u) const;

    // Parts of the radiance, if it is split:
    void addComponent(std::vector<Rgb>& components, uint32_t path, int light, bool isDirect, const Rgb& c);
    void startComponents(size_t paths);
    void joinComponents();
    void takeComponents(size_t paths, std::span<Rgb> components) const;

    /// At a surface that is neither mirror nor glass: whether the path is to bring direct light only. Then it
    /// finds lights by BSDF samples of their own, not by its next ray.
    bool endsHere(const Path& path) const {
        return !m_settings.path || path.component == LightComponent::Direct;
    }
    uint32_t dimension(uint32_t offset) const {
        return kFirstDimension + uint32_t(m_bounce) * kDimensionsPerVertex + offset;
    }
    /// Very many lights share them: few of those are sampled at a vertex.
    uint32_t dimensionOf(int light) const {
        constexpr uint32_t kMax = (kDimensionsPerVertex - kDimLights) / kDimensionsPerLight;
        return dimension(kDimLights + kDimensionsPerLight * (uint32_t(light) % kMax));
    }
    /// The numbers of the paths of vertices, `n` for each, from number `first` of them on.
    std::span<const SampleRange> ranges(const int32_t* vertices, int count, int first = 0, int drawn = 1,
                                        int n = 1);

    struct LightVisible {
        PathWorker* worker;
        void operator()(const ShadowAnswers& answers) const { worker->addVisible(answers); }
    };
    struct ProbeFound {
        PathWorker* worker;
        void operator()(const LightProbe& probe, const Hit& hit) const { worker->finishProbe(probe, hit); }
    };
    struct BounceFound {
        PathWorker* worker;
        void operator()(uint32_t path, const Hit& hit) const { worker->meet(path, hit); }
    };

    const Scene& m_scene;
    const Sampler& m_sampler;
    const ShadeSettings m_settings;
    const LightComponents m_lightComponents;
    const bool m_manyMaterials;
    Counters* m_counters = nullptr;

    std::vector<Rgb> m_components,
        m_componentsViaBsdf; ///< path by path, as Path's radiance and viaBsdf; empty: no split
    std::vector<Path> m_paths;
    std::vector<uint32_t> m_active, m_next, m_sorted;
    std::vector<uint32_t> m_albedos; ///< paths that ask for one, and for no light
    std::vector<uint8_t> m_bucket;   ///< path by path: a number for the material that it meets
    bool m_probed = false;           ///< in this wave
    int m_bounce = 0;
    ShadowQueue<LightVisible> m_shadows;
    HitQueue<LightProbe, ProbeFound> m_probes;
    HitQueue<uint32_t, BounceFound> m_bounces;

    // The chunk at hand, and scratch.
    VertexSoA m_v;
    HitSoA m_hits; ///< this and the next three: by vertex
    SurfaceSoA m_surface;
    V2SoA m_duvdx, m_duvdy;
    alignas(64) float m_width[kSoAWidth]; ///< of the rays' cones
    VertexRows m_rows;                    ///< of m_v, by sample
    LightSoA m_light;
    BsdfSampleSoA m_drawn;
    V3SoA m_wi;
    V2SoA m_u;
    alignas(64) float m_uLobe[kSoAWidth], m_uRoulette[kSoAWidth], m_cosine[kSoAWidth];
    alignas(64) float m_bsdfShare[kSoAWidth]; ///< by vertex: BSDF samples that compete with the light's
    std::array<SampleRange, kSoAWidth> m_ranges;
    uint32_t m_missed[kSoAWidth];
};

} // namespace strobe
