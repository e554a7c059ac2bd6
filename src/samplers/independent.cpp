#include "samplers/independent.h"

#include "core/math/hash.h"

namespace strobe {

namespace {

const ParamDef<int> kPixelSamples{"pixelsamples", 4, "number of samples per pixel", "samples", kAtLeastOne};

class IndependentSampler final : public Sampler {
  public:
    void fill1D(const SampleRange& range, uint32_t dim, float* out) const override {
        const uint64_t base = hashOf(range.domain, dim);
        for (uint32_t i = 0; i < range.n; ++i)
            out[i] = unitFloat(static_cast<uint32_t>(hashCombine(base, range.first + i) >> 32));
    }
    void fill2D(const SampleRange& range, uint32_t dim, V2f* out) const override {
        const uint64_t base = hashOf(range.domain, dim, 2);
        for (uint32_t i = 0; i < range.n; ++i) {
            const uint64_t bits = hashCombine(base, range.first + i);
            out[i] = {unitFloat(static_cast<uint32_t>(bits >> 32)), unitFloat(static_cast<uint32_t>(bits))};
        }
    }
};

} // namespace

Plugin<SamplerSetup, int> independentPlugin() {
    return {"independent",
            "independent random numbers (pbrt: also \"random\")",
            {kPixelSamples},
            [](const ParamSet& params, const BuildContext&, int sppOverride) -> SamplerSetup {
                const int spp = params.get(kPixelSamples);
                return {std::make_shared<IndependentSampler>(), sppOverride > 0 ? sppOverride : spp};
            }};
}

} // namespace strobe
