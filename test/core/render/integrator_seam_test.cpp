// A complete integrator, defined outside of the library: visibility samples of the same 2x2 pixels that hit
// the same primitive share a shade.
#include "core/render/integrator.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <array>
#include <map>

namespace strobe {
namespace {

/// Maps samples to shades on one thread.
class QuadWorker : public IntegratorWorker {
  public:
    explicit QuadWorker(const Scene& scene) : m_scene(scene) {}

    /// The first sample of each group requests a shade.
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        std::map<GroupKey, uint32_t> requestOfGroup;
        m_requestOfSample.clear();
        for (const VisibilitySample& sample : batch.samples) {
            const auto [group, isNew] =
                requestOfGroup.try_emplace(groupKey(batch, sample), uint32_t(requests.size()));
            if (isNew)
                requests.push_back(requestFor(m_scene, batch, sample));
            m_requestOfSample.push_back(group->second);
        }
    }

    /// All samples of a group have the radiance of its shade.
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i)
            values[i] = shaded[m_requestOfSample[i]];
        return values;
    }

  private:
    /// The 2x2 pixels and the primitive. All samples that missed have the same primitive.
    using GroupKey = std::array<uint32_t, 5>;
    static GroupKey groupKey(const VisibilityBatch& batch, const VisibilitySample& sample) {
        const PixelRef& pixel = batch.pixels[sample.pixel];
        return {uint32_t(pixel.x / 2), uint32_t(pixel.y / 2), sample.hit.instance, sample.hit.geometry,
                sample.hit.prim};
    }

    const Scene& m_scene;
    std::vector<uint32_t> m_requestOfSample; ///< per sample of the batch, an index into the requests
};

class QuadIntegrator : public Integrator {
  public:
    /// A shade is at most the diagonal of 2x2 pixels away (for a pixel filter of one pixel), at any time.
    BiasBound biasBound(const Scene&) const override { return {2 * std::sqrt(2.f), 1}; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<QuadWorker>>(scene);
    }
};

TEST(IntegratorSeam, AnIntegratorDecidesWhichSamplesShareAShade) {
    // The camera is inside of a sphere, so every sample hits the same primitive.
    BuiltScene built = test::build(R"(
        Film "image" "integer xresolution" 16 "integer yresolution" 2
        Sampler "sobol" "integer pixelsamples" 16
        Integrator "directlighting"
        Camera "perspective"
        WorldBegin
        LightSource "infinite"
        Material "matte"
        Translate 0 0 3
        Shape "sphere" "float radius" 9
        )");
    const test::Rendered reference = test::render(built);
    EXPECT_EQ(reference.stats.total.shades, 16u * 2 * 16) << "one shade per sample";

    built.integrator = std::make_shared<const QuadIntegrator>();
    const test::Rendered shared = test::render(built);
    EXPECT_EQ(shared.stats.total.visibilitySamples, reference.stats.total.visibilitySamples);
    EXPECT_EQ(shared.stats.total.shades, 8u) << "one shade per 2x2 pixels";
    for (int x = 0; x < 16; x += 2) {
        EXPECT_EQ(shared.image.at(x, 0), shared.image.at(x + 1, 0));
        EXPECT_EQ(shared.image.at(x, 0), shared.image.at(x, 1));
        EXPECT_EQ(shared.image.at(x, 0), shared.image.at(x + 1, 1));
    }
}

} // namespace
} // namespace strobe
