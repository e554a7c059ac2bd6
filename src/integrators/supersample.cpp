#include "integrators/supersample.h"

namespace strobe {

namespace {

class Worker : public IntegratorWorker {
  public:
    explicit Worker(const Scene& scene) : m_scene(scene) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        requestForEach(m_scene, batch, requests);
    }
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
        return std::make_unique<UnsharedState<Worker>>(scene);
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
