// The shader interface: the expensive function that estimates radiance.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/params/plugin.h"
#include "core/render/batch.h"
#include "core/render/stats.h"

#include <memory>
#include <span>

namespace strobe {

/// Estimates radiance for shading requests. Each thread has a worker of its own. The result for a request
/// depends on that request alone, not on the other requests of the batch.
class ShaderWorker {
  public:
    virtual ~ShaderWorker() = default;
    /// Writes to radiance[i] an estimate of the radiance that arrives at the origin of requests[i].ray from
    /// its direction. Estimates of the light components follow, component by component, each with as many
    /// values. Counts `shades`, `directShades` and `missed`.
    virtual void shade(const ShadingRequests& requests, std::span<Rgb> radiance, Counters& counters) = 0;
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
