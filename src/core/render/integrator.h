// The two seams of rendering: an Integrator decides which visibility samples share a shade, a Shader shades.
//
//     camera samples -> trace -> hits -> PLAN -> shading requests -> shade(batch) -> RESOLVE -> film
#pragma once

#include "core/image/image.h"
#include "core/math/pixel_bounds.h"
#include "core/params/plugin.h"
#include "core/render/batch.h"
#include "core/render/stats.h"
#include "core/scene/scene.h"

#include <functional>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

namespace strobe {

/// How radiance is to be split, besides its whole: into direct and indirect light (see LightComponent; what
/// is seen in mirrors and glass included), and by the groups of the lights that it comes from.
struct LightComponents {
    bool byBounce = false;
    int groups = 0; ///< 0: not by groups
    /// Parts per request: direct, indirect, then each group; those that are asked for.
    int count() const { return (byBounce ? 2 : 0) + groups; }
};

/// The mapping from visibility samples to shades, many to one. One worker per thread.
class IntegratorWorker {
  public:
    virtual ~IntegratorWorker() = default;
    /// Appends the shades that the batch needs to `requests` (empty at the call).
    virtual void plan(const VisibilityBatch& batch, ShadingRequests& requests) = 0;
    /// The radiance of each of batch.samples that is wanted, from the shaded requests of `plan`: written to
    /// `room`, unless it is `shaded` as it stands.
    virtual std::span<const Rgb> resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                         std::span<Rgb> room) = 0;
    /// After `resolve`: the same for part `part` of the radiance, from the shades' parts. A worker whose
    /// values are nothing but sums of its batch's shades needs no other than this.
    virtual std::span<const Rgb> resolveComponent(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                                  std::span<Rgb> room, int /*component*/) {
        return resolve(batch, shaded, room);
    }
    /// Called before the first batch of each tile.
    virtual void beginTile() {}
    /// After `resolve`: a number for what the sample's value came from, the same for samples that share it; 0
    /// if it shares with none. For pictures of the sharing.
    virtual uint64_t sharingId(size_t /*sample*/) const { return 0; }
    /// Adds what the worker has counted; called once, after its last batch.
    virtual void report(Counters& /*counters*/) const {}
};

/// What an integrator may want to know of the render that begins.
struct RenderContext {
    uint64_t seed = 0; ///< for random numbers that belong to no pixel
    int threads = 1;
    int samplesPerPixel = 1;
    PixelBounds pixelBounds;
    bool hasIndirectLight = true; ///< see Shader
    /// Shades a few points here and there and measures what a shade costs.
    std::function<ShadeCost()> measureShadeCost;
    int lightComponents = 0; ///< that radiance is split into, see LightComponents
};

/// One render under way: what an integrator's workers share.
class IntegratorState {
  public:
    virtual ~IntegratorState() = default;
    virtual std::unique_ptr<IntegratorWorker> makeWorker() = 0;
    /// Forgets what was shaded: from now on this is the render that `begin` would have made with this seed
    /// and number of samples. The workers made before are gone.
    virtual void restart(uint64_t /*seed*/, int /*samplesPerPixel*/) {}
};

/// On what a sample's value depends, beside the scene, the settings and its own numbers: on nothing (also
/// not if what it shares depends on its place alone), on the other samples of its pixel, or on the course of
/// the render.
enum class SampleDependence { None, Pixel, Render };

/// How far from a sample's own point the radiance may be taken that becomes its value: the mean over seeds
/// departs from the truth by no more than radiance varies on the same surface within `reachPixels` (as seen
/// by the sample) and `shutterFraction` of the shutter. Zeros: unbiased.
struct BiasBound {
    float reachPixels = 0, shutterFraction = 0;
};

class Integrator {
  public:
    virtual ~Integrator() = default;
    virtual BiasBound biasBound(const Scene& /*scene*/) const { return {}; }
    /// Decides how slices of a pixel's samples are rendered. With `Render`, they cannot be.
    virtual SampleDependence dependence() const { return SampleDependence::Render; }
    /// Scene and whatever the context refers to outlive the render.
    virtual std::unique_ptr<IntegratorState> begin(const Scene& scene,
                                                   const RenderContext& context) const = 0;
};

/// The expensive function. One worker per thread; a request's radiance depends on the request alone, not on
/// its companions in the batch. Counts `shades`, `directShades` and `missed`.
class ShaderWorker {
  public:
    virtual ~ShaderWorker() = default;
    /// radiance[i] = an estimate of the light that arrives along requests[i].ray, reversed; then, for each
    /// part of the split, as many numbers.
    virtual void shade(const ShadingRequests& requests, std::span<Rgb> radiance, Counters& counters) = 0;
};

class Shader {
  public:
    virtual ~Shader() = default;
    virtual std::unique_ptr<ShaderWorker> makeWorker(const Scene& scene, const Sampler& sampler,
                                                     const LightComponents& split) const = 0;
    /// False: LightComponent::Indirect is always black.
    virtual bool hasIndirectLight() const = 0;
};

/// The render of an integrator whose workers share nothing: each is made from the scene and a few settings.
template <class Worker, class... Settings>
class UnsharedState : public IntegratorState {
  public:
    explicit UnsharedState(const Scene& scene, Settings... settings)
        : m_scene(scene), m_settings(settings...) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::apply([&](const auto&... s) { return std::make_unique<Worker>(m_scene, s...); },
                          m_settings);
    }

  private:
    const Scene& m_scene;
    std::tuple<Settings...> m_settings;
};

} // namespace strobe
