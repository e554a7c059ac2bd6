// The simplest integrator, as an example of the interface (core/render/integrator.h).
#include "integrators/supersample.h"

#include "core/params/plugin.h"
#include "core/render/batch.h"

namespace strobe {

namespace {

/// Maps each visibility sample of a batch to a shading request of its own. Each thread has a worker.
class SupersampleWorker : public IntegratorWorker {
  public:
    explicit SupersampleWorker(const Scene& scene) : m_scene(scene) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        requestForEach(m_scene, batch, requests);
    }

    /// Request i is that of sample i, so the shaded values are the result.
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb>) override {
        return shaded;
    }

  private:
    const Scene& m_scene;
};

class Supersample : public Integrator {
  public:
    BiasBound biasBound(const Scene&) const override { return {}; }
    SampleDependence dependence() const override { return SampleDependence::None; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<SupersampleWorker>>(scene);
    }
};

} // namespace

IntegratorPlugin supersamplePlugin() {
    return {"supersample",
            "one shade per visibility sample: the baseline",
            {},
            [](const ParamSet&, const BuildContext&) { return std::make_shared<const Supersample>(); }};
}

} // namespace strobe
