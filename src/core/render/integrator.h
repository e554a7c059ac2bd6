// The integrator interface: an Integrator decides which visibility samples share a shade.
//
//     camera samples -> trace -> hits -> PLAN -> shading requests -> shade(batch) -> RESOLVE -> film
//
// docs/tutorial-integrator.md builds an integrator step by step.
#pragma once

#include "core/film/film.h"
#include "core/math/api.h"
#include "core/math/pixel_bounds.h"
#include "core/math/sample_factors.h"
#include "core/params/plugin.h"
#include "core/render/batch.h"
#include "core/render/shader.h"
#include "core/render/stats.h"
#include "core/scene/scene.h"

#include <functional>
#include <memory>
#include <span>
#include <tuple>

namespace STROBE_API strobe {

/// Maps the visibility samples of a batch to shading requests, many to one, and the shaded requests back to
/// samples. Each thread has a worker of its own, which processes one batch at a time: `plan`, then `resolve`.
class IntegratorWorker {
  public:
    virtual ~IntegratorWorker() = default;
    /// Appends the shading requests of the batch to `requests`. `requestFor` returns the request that shades
    /// a single sample. Precondition: `requests` is empty.
    virtual void plan(const VisibilityBatch& batch, ShadingRequests& requests) = 0;
    /// Returns the radiance of each sample of the batch. `shaded` has the radiance of each request of the
    /// last `plan`, `values` has space for each sample. The result is `values`, filled, or `shaded` itself.
    /// Samples outside of `batch.filmSlice` may have any value.
    virtual std::span<const Rgb> resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                         std::span<Rgb> values) = 0;
    /// Returns one component of the radiance of each sample (0 <= component < LightComponents::count), after
    /// `resolve`. The default calls `resolve` again, which is correct if that depends on its arguments and
    /// the last `plan` only; a worker that stores shades elsewhere overrides it.
    virtual std::span<const Rgb> resolveComponent(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                                  std::span<Rgb> values, int /*component*/) {
        return resolve(batch, shaded, values);
    }
    /// Records the radiance and the first vertices of the requests of the last `plan`, for `endTile`. Called
    /// after `resolve` if IntegratorState::observes is true.
    virtual void observe(const VisibilityBatch& /*batch*/, std::span<const Rgb> /*radiance*/,
                         std::span<const FirstVertex> /*vertices*/) {}
    /// Called before the first batch of each tile.
    virtual void beginTile(const Film& /*film*/) {}
    /// Called after the last batch of each tile, unless RenderSettings::stop ended it. A worker that records
    /// adds its record of the tile to the film, so that later renders and other processes can add samples. If
    /// the film does not accumulate, the worker may add the record to the state instead.
    virtual void endTile(const PixelBounds& /*tile*/, Film& /*film*/) {}
    /// Returns an id of the shades from which the value of sample number `sample` of the batch was computed,
    /// after `resolve`. Samples that share have the same id; 0: the sample does not share. For Aov::Cell and
    /// --samples.
    virtual uint64_t sharingId(size_t /*sample*/) const { return 0; }
    /// Adds the worker's counters; called once, after its last batch.
    virtual void report(Counters& /*counters*/) const {}
};

class IntegratorState;

/// Renders pixels of films, each as one tile, on one thread at a time. Its buffers are reused.
class PilotRenderer {
  public:
    virtual ~PilotRenderer() = default;
    /// Renders some pixels of a film, each once. Returns the counters of this film.
    virtual Counters render(Film& film, std::span<const V2i> pixels, uint64_t seed) = 0;
};

/// Makes a renderer with a state, which outlives it. Any thread may call it.
using MakePilotRenderer =
    std::function<std::unique_ptr<PilotRenderer>(IntegratorState& state, int samplesPerPixel)>;

/// How camera samples are chosen.
struct CameraSampling {
    const Sampler& sampler;
    const Filter& filter;
    uint64_t seed; ///< of the render; also for random numbers that belong to no pixel
};

/// The properties of a render that an integrator may depend on.
struct RenderContext {
    CameraSampling sampling; ///< outlives the integrator's state
    int threads = 1;
    int samplesPerPixel = 1;
    bool isPass = false;       ///< more samples per pixel may follow: see RenderSettings
    bool keepsRecords = false; ///< Film::accumulates
    PixelBounds pixelBounds{};
    PixelBounds pilotBounds{};             ///< see RenderSettings
    float clamp = 0;                       ///< see RenderSettings
    bool hasIndirectLight = true;          ///< see Shader
    int lightComponents = 0;               ///< LightComponents::count
    ShadeCost shadeCost{};                 ///< the cost of a shade, if Integrator::needsShadeCost is true
    MakePilotRenderer makePilotRenderer{}; ///< for Integrator::begin only
};

/// State that the workers of one render share.
class IntegratorState {
  public:
    virtual ~IntegratorState() = default;
    virtual std::unique_ptr<IntegratorWorker> makeWorker() = 0;
    /// Prepares a pass with this seed and number of samples. The state becomes what `begin` would have
    /// returned. The workers made before no longer exist.
    virtual void restart(uint64_t /*seed*/, int /*samplesPerPixel*/) {}
    /// Returns a note for the user in a few words, such as a decision of the state; empty: none.
    virtual std::string note() const { return {}; }
    /// Returns the factors of the number of samples of each pixel; null: 1 everywhere.
    virtual const SampleFactors* sampleFactors() const { return nullptr; }
    /// True if the workers `observe` first vertices.
    virtual bool observes() const { return false; }
    /// True if the workers add records of tiles to films or to the state.
    virtual bool records() const { return observes(); }
    /// Adds a correction to the image of a film that holds all samples and records rendered so far, and sets
    /// layers of the film. The film's sums do not change; its records may become fewer, but add up to the
    /// same. Removes what workers added to the state. If `errors` is not null and the errors of the corrected
    /// pixels are known, it receives their estimated standard errors, row by row: means of the channels.
    virtual void finish(Film& /*film*/, std::vector<float>* /*errors*/) const {}
};

/// The dependence of a sample's value on other samples.
enum class SampleDependence {
    None,   ///< on none; or each shared shade is a function of a key, such as a point on a surface
    Pixel,  ///< on the samples of its pixel
    Render, ///< on other samples of its batch, on tiles, or on the order in which threads render
};

/// The maximum distance between a sample's own surface point and the points at which the shades that it uses
/// were made. The bias of the mean over seeds is at most the variation of radiance over the same surface
/// within `reachPixels` pixels (as seen by the sample) and `shutterFraction` of the shutter. Zeros: the
/// integrator is unbiased. Infinity: no bound is known.
struct BiasBound {
    float reachPixels = 0, shutterFraction = 0;
};

class Integrator {
  public:
    virtual ~Integrator() = default;
    /// Returns a bound for all pixels of the scene. It is written to images and statistics.
    virtual BiasBound biasBound(const Scene& scene) const = 0;
    /// With Pixel, all samples of a pixel are traced and planned to render a slice of them. With Render,
    /// slices and checkpoints are errors.
    virtual SampleDependence dependence() const { return SampleDependence::Render; }
    /// Returns the fewest samples per pixel with which a pass is worth its time: fewer cannot share.
    virtual int fewestSamplesOfPass() const { return 1; }
    /// Returns about how many shades a pixel takes, for an estimate of the time.
    virtual double shadesPerPixel(int samplesPerPixel) const { return samplesPerPixel; }
    /// Returns true if `begin` reads context.shadeCost. Measuring it takes some milliseconds.
    virtual bool needsShadeCost(const RenderContext& /*context*/) const { return false; }
    /// Replaces records of the same pixels by their sum, so that memory does not grow with the number of
    /// parts. Throws Error of kind Usage if a record is damaged.
    virtual void mergeRecords(FilmRecords& /*records*/) const {}
    /// Completes a film of parts that were rendered by other processes, from its records alone. Throws Error
    /// of kind Usage if the records are damaged.
    virtual void finishMerged(Film& /*film*/) const {}
    /// Begins a render. The scene outlives the state.
    virtual std::unique_ptr<IntegratorState> begin(const Scene& scene,
                                                   const RenderContext& context) const = 0;
};

using IntegratorPlugin = Plugin<std::shared_ptr<const Integrator>>;

/// The state of an integrator whose workers share nothing: a worker is constructed from the scene and these
/// settings.
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
