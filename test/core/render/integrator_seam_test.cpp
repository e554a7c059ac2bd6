// A third way to share, written outside the library: one shade per 2x2 pixels and primitive. It takes one
// worker and nothing else, which is what the seam is for.
#include "integrators/supersample.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <map>

namespace strobe {
namespace {

class QuadWorker : public IntegratorWorker {
  public:
    explicit QuadWorker(const Scene& scene) : m_scene(scene) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        std::map<std::array<uint32_t, 5>, uint32_t> groups;
        m_request.clear();
        for (const VisibilitySample& s : batch.samples) {
            const PixelRef& pixel = batch.pixels[s.pixel];
            const auto [it, isNew] = groups.try_emplace(
                {uint32_t(pixel.x / 2), uint32_t(pixel.y / 2), s.hit.instance, s.hit.geometry, s.hit.prim},
                requests.size());
            if (isNew)
                requests.push_back(requestFor(m_scene, batch, s));
            m_request.push_back(it->second);
        }
    }
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i)
            values[i] = shaded[m_request[i]];
        return values;
    }

  private:
    const Scene& m_scene;
    std::vector<uint32_t> m_request;
};

class Quads : public Integrator {
  public:
    BiasBound biasBound(const Scene&) const override { return {}; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<QuadWorker>>(scene);
    }
};

TEST(Seam, AnIntegratorIsOneMapping) {
    BuiltScene built =
        test::build("Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 2\n"
                    "Sampler \"sobol\" \"integer pixelsamples\" 16\nIntegrator \"directlighting\"\n"
                    "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nMaterial \"matte\"\n"
                    "Translate 0 0 3\nShape \"sphere\" \"float radius\" 9\n");
    const auto truth = test::render(built);
    built.integrator = std::make_shared<const Quads>();
    const auto shared = test::render(built);
    EXPECT_EQ(truth.stats.total.shades, 32u * 16);
    // Two rows of sixteen pixels in one batch: one shade per pair of columns.
    EXPECT_EQ(shared.stats.total.shades, 8u);
    EXPECT_EQ(shared.stats.total.visibilitySamples, truth.stats.total.visibilitySamples);
}

} // namespace
} // namespace strobe
