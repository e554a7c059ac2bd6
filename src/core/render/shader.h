// The shader interface: the expensive function that estimates radiance.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/math/api.h"
#include "core/params/plugin.h"
#include "core/render/batch.h"
#include "core/render/stats.h"

#include <memory>
#include <span>

namespace STROBE_API strobe {

/// The first vertex of a path that is neither a mirror nor glass, nor polished metal or slightly rough glass,
/// in world space, and parts of its radiance.
struct FirstVertex {
    Hit hit; ///< empty: the path has no such vertex
    V3f p{0};
    V3f n{0};                     ///< unit geometric normal, on the side of the viewer
    V3f ns{0};                    ///< unit shading normal, on the same side of the surface
    V3f dpdu{0};                  ///< see SurfacePoint
    bool isFront = false;         ///< n is SurfacePoint::ng; false: its opposite
    bool hasMappedNormal = false; ///< of ShadingNormal::Mapped
    float coneWidth = 0;          ///< of the path's ray cone
    Rgb albedo = Rgb(0); ///< throughput to the vertex, times Material::reflectance if flags ask for it
    // Parts of the path's radiance:
    Rgb direct = Rgb(0);   ///< direct light at the vertex, without its emission
    Rgb indirect = Rgb(0); ///< light that reaches the vertex by other surfaces
    bool hasIndirect = false;
    Rgb emitted = Rgb(0); ///< the light that the camera ray itself hits: emission or the background
};

/// Where a shader writes its results, by request.
struct ShadeOutput {
    std::span<Rgb> radiance;              ///< and the light components: see ShaderWorker::shade
    std::span<FirstVertex> firstVertices; ///< empty: not wanted
};

/// Estimates radiance for shading requests. Each thread has a worker of its own. The result for a request
/// depends on that request alone, not on the other requests of the batch.
class ShaderWorker {
  public:
    virtual ~ShaderWorker() = default;
    /// Writes to out.radiance[i] an estimate of the radiance that arrives at the origin of requests[i].ray
    /// from its direction. Estimates of the light components follow, component by component, each with as
    /// many values. Writes the first vertices if they are wanted. Counts `shades`, `directShades` and
    /// `missed`.
    virtual void shade(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters) = 0;
};

class Shader {
  public:
    virtual ~Shader() = default;
    virtual std::unique_ptr<ShaderWorker> makeWorker(const Scene& scene, const Sampler& sampler,
                                                     const LightComponents& components) const = 0;
    /// False: LightComponent::Indirect is always black.
    virtual bool hasIndirectLight() const = 0;
};

using ShaderPlugin = Plugin<std::shared_ptr<const Shader>>;

} // namespace strobe
