#include "integrators/supersample.h"

#include "core/params/plugin.h"

namespace strobe {

namespace {

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
