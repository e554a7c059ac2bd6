// A sampler of low-discrepancy points that needs no tables: multiples of irrational numbers, modulo 1
// (Kronecker sequences), with the numbers of Roberts, "The Unreasonable Effectiveness of Quasirandom
// Sequences" (2018).
#include <strobe/plugin.h>

namespace strobe {

namespace {

const ParamDef<int> kPixelSamples{"pixelsamples", 16, "number of samples per pixel", nullptr, kAtLeastOne};

/// Multiples i a modulo 1 + a rotation, in units of 2^-64, whose highest 32 bits become a number in [0,1).
float rotated(uint64_t step, uint32_t i, uint64_t rotation) {
    return unitFloat(uint32_t((step * i + rotation) >> 32));
}

/// Each domain and dimension has a rotation of its own, so that they are independent.
class KroneckerSampler final : public Sampler {
  public:
    using Sampler::fill1D, Sampler::fill2D;
    void fill1D(const SampleRange& range, uint32_t dim, float* out) const override {
        constexpr uint64_t kStep = 0x9E3779B97F4A7C15; // 1/g, g² = g + 1
        const uint64_t rotation = hashOf(range.domain, dim, 1);
        for (uint32_t i = 0; i < range.n; ++i)
            out[i] = rotated(kStep, range.first + i, rotation);
    }
    void fill2D(const SampleRange& range, uint32_t dim, V2f* out) const override {
        constexpr uint64_t kStepX = 0xC13FA9A902A6328F, kStepY = 0x91E10DA5C79E7B1C; // 1/g, 1/g²; g³ = g + 1
        const uint64_t rotationX = hashOf(range.domain, dim, 2), rotationY = hashOf(range.domain, dim, 3);
        for (uint32_t i = 0; i < range.n; ++i)
            out[i] = {rotated(kStepX, range.first + i, rotationX),
                      rotated(kStepY, range.first + i, rotationY)};
    }
};

} // namespace

SamplerPlugin kroneckerPlugin() {
    return {"kronecker",
            "multiples of irrational numbers, rotated for each pixel and dimension",
            {kPixelSamples},
            [](const ParamSet& params, const BuildContext&, int samplesPerPixel) -> SamplerSetup {
                const int fromScene = params.get(kPixelSamples);
                return {std::make_shared<const KroneckerSampler>(),
                        samplesPerPixel > 0 ? samplesPerPixel : fromScene};
            }};
}

} // namespace strobe

STROBE_PLUGIN_LIBRARY([](strobe::PluginRows& rows) { rows.add(strobe::kroneckerPlugin()); })
