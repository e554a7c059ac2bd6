// The paths of one batch of shading requests.
#pragma once

#include "core/render/shader.h"
#include "core/scene/scene.h"

#include <vector>

namespace strobe {

/// Where the last ray of a path starts.
enum class PathStage : uint8_t {
    Camera,   ///< at the camera, or at a mirror or glass that the camera sees
    FirstHit, ///< at the first non-specular vertex
    Indirect, ///< at a later vertex
};

/// One path in progress.
struct Path {
    Hit hit; ///< of `ray`
    Ray ray; ///< the last ray
    RayCone cone;
    Rgb beta; ///< throughput
    Rgb radiance;
    Rgb lightRayRadiance; ///< sum of this wave's light rays: see PathBatch::addLightRaySums
    uint64_t domain;      ///< set of random numbers: this path's are member `index` of `total`
    uint32_t index, total;
    LightComponent component;
    Rgb absorption;    ///< of the medium that the last ray crosses, per unit length
    bool isAbsorbed;   ///< `absorption` is not 0
    int32_t crossings; ///< vertices that do not count for PathSettings::maxDepth
    // The BSDF sample that the last ray follows, for the MIS weight of the light that it hits:
    bool specularBounce; ///< camera ray or delta lobe: light samples cannot find the light
    PathStage stage;
    PathStage recorded;         ///< as `stage`, with sharp vertices as specular ones: for firstVertices
    bool sampledLightIsDirect;  ///< light samples at the current vertex are direct light
    bool sampledAllLights;      ///< the vertex sampled every light; false: one, or as many as the light tree
                                ///< chooses
    float bsdfPdf;              ///< per solid angle; 0 for a delta lobe
    float maxBsdfPdf;           ///< an upper bound of the BSDF's pdf at the vertex
    V3f previousP;              ///< position of the vertex
    V3f previousNg, previousNs; ///< its unit normals, on the side of the viewer
    bool previousTransmits;     ///< its material transmits light

    void setPreviousVertex(const LightPoint& vertex) {
        previousP = vertex.p;
        previousNg = vertex.ng;
        previousNs = vertex.ns;
        previousTransmits = vertex.transmits;
    }
    LightPoint previousVertex() const {
        return {previousP, previousNg, previousNs, previousTransmits, ray.time};
    }

    /// Starts the path of request `i`, with a throughput of 1. Leaves `hit` unset. Copies number by number,
    /// because a vector load right after scalar stores to the same bytes stalls.
    void start(const RequestSoA& requests, int i);
};

/// Sums of the light components of each path of a batch. They do not affect the radiance.
class ComponentSums {
  public:
    ComponentSums(const Scene& scene, const LightComponents& layout)
        : m_scene(scene), m_layout(layout), m_count(size_t(layout.count())) {}
    /// False when radiance is not split into components.
    bool isEnabled() const { return m_count > 0; }
    /// Makes room for the sums of `paths` paths and sets all to 0.
    void reset(size_t paths) { m_sums.assign(paths * m_count, Rgb(0)); }
    /// Adds a contribution of light `light` to the components of a path.
    void add(uint32_t path, int light, bool isDirect, const Rgb& contribution);
    /// Adds the sums of a path in `from`, and sets them to 0 there.
    void moveFrom(ComponentSums& from, uint32_t path);
    /// Number of components.
    size_t count() const { return m_count; }
    const Rgb& at(size_t path, size_t component) const { return m_sums[path * m_count + component]; }

  private:
    const Scene& m_scene;
    const LightComponents m_layout;
    const size_t m_count;
    std::vector<Rgb> m_sums; ///< path by path
};

/// The state of a batch. A worker reuses one for all its batches, so that memory is allocated once.
struct PathBatch {
    PathBatch(const Scene& scene, const LightComponents& components);
    /// Starts a path for each request, and counts `shades`, `directShades` and `missed`. `counters` must
    /// outlive the batch.
    void start(const ShadingRequests& requests, Counters& counters);
    /// Sets the hit of a path's last ray.
    void setHit(uint32_t path, const Hit& hit) {
        paths[path].hit = hit;
        if (m_hasManyMaterials)
            m_materialBuckets[path] = hit ? uint8_t(m_scene.geometry(hit).material % kMaterialBuckets) : 0;
    }
    /// Sorts indices of paths by the material that the paths hit, modulo kMaterialBuckets. The sort is
    /// stable.
    void sortByMaterial(std::vector<uint32_t>& indices);
    /// Adds light that the last ray of a path hit.
    void addHitLight(uint32_t path, int light, const Rgb& contribution) {
        paths[path].radiance += contribution;
        if (components.isEnabled())
            components.add(path, light, paths[path].stage != PathStage::Indirect, contribution);
    }
    /// Adds light that a light ray found to the light ray sums of its path.
    void addLightRay(uint32_t path, int light, const Rgb& contribution) {
        paths[path].lightRayRadiance += contribution;
        if (lightRayComponents.isEnabled())
            lightRayComponents.add(path, light, paths[path].sampledLightIsDirect, contribution);
    }
    /// Adds the light ray sums of the active paths to their radiance and clears them. Called once a wave, so
    /// that no sum depends on the order in which packets of shadow rays and of light rays fill up.
    void addLightRaySums();
    /// Writes the radiance of all paths, then each component: see ShaderWorker::shade.
    void write(size_t requests, std::span<Rgb> radiance);

    std::vector<Path> paths;      ///< by request; may be longer than the batch
    std::vector<uint32_t> active; ///< the paths of the current wave
    std::vector<uint32_t> next;   ///< the paths of the next wave
    std::vector<uint32_t> albedo; ///< paths that hit a surface and estimate LightComponent::Albedo
    ComponentSums components;
    ComponentSums lightRayComponents; ///< components of Path::lightRayRadiance
    Counters* counters = nullptr;
    std::span<FirstVertex> firstVertices; ///< by request; empty: not wanted

  private:
    static constexpr int kMaterialBuckets = 64;

    const Scene& m_scene;
    const bool m_hasManyMaterials;
    std::vector<uint8_t> m_materialBuckets; ///< by path
    std::vector<uint32_t> m_sorted;         ///< scratch of sortByMaterial
};

} // namespace strobe
