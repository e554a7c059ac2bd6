// Requests made side by side are those made one by one.
#include "core/render/integrator.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Compares, and asks for every sample's own shade.
class ComparingWorker : public IntegratorWorker {
  public:
    ComparingWorker(const Scene& scene, size_t* compared) : m_scene(scene), m_compared(compared) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        requestForEach(m_scene, batch, requests);
        ASSERT_EQ(requests.size(), batch.samples.size());
        uint32_t i = 0;
        for (const VisibilitySample& sample : batch.samples) {
            const ShadingRequest one = requestFor(m_scene, batch, sample), many = requests[i];
            EXPECT_EQ(one.sample, i++);
            EXPECT_EQ(many.sample, one.sample);
            EXPECT_EQ(many.hit.instance, one.hit.instance);
            EXPECT_EQ(many.hit.geometry, one.hit.geometry);
            EXPECT_EQ(many.hit.prim, one.hit.prim);
            EXPECT_EQ(many.hit.u, one.hit.u);
            EXPECT_EQ(many.hit.v, one.hit.v);
            EXPECT_EQ(many.hit.t, one.hit.t);
            EXPECT_EQ(many.ray.o, one.ray.o);
            EXPECT_EQ(many.ray.d, one.ray.d);
            EXPECT_EQ(many.ray.time, one.ray.time);
            EXPECT_EQ(many.cone.width, one.cone.width);
            EXPECT_EQ(many.cone.spread, one.cone.spread);
            EXPECT_EQ(many.domain, one.domain);
            EXPECT_EQ(many.index, one.index);
            EXPECT_EQ(many.total, one.total);
            EXPECT_EQ(many.component, one.component);
            ++*m_compared;
        }
    }
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        std::copy(shaded.begin(), shaded.end(), values.begin());
        return values;
    }

  private:
    const Scene& m_scene;
    size_t* m_compared;
};

class Comparing : public Integrator {
  public:
    BiasBound biasBound(const Scene&) const override { return {}; }
    explicit Comparing(size_t* compared) : m_compared(compared) {}
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<ComparingWorker, size_t*>>(scene, m_compared);
    }

  private:
    size_t* m_compared;
};

TEST(Batch, RequestsForAllAreThoseOfEach) {
    BuiltScene built =
        test::build("Film \"image\" \"integer xresolution\" 15 \"integer yresolution\" 7\n"
                    "Sampler \"independent\" \"integer pixelsamples\" 11\nIntegrator \"directlighting\"\n"
                    "Camera \"perspective\" \"float lensradius\" .1 \"float focaldistance\" "
                    "3\nWorldBegin\nLightSource \"infinite\"\n"
                    "Texture \"c\" \"rgb\" \"checkerboard\"\nMaterial \"matte\" \"texture Kd\" \"c\"\n"
                    "Translate 0 0 3\nShape \"sphere\"\n");
    ASSERT_TRUE(built.scene->needsFootprint());
    const auto truth = test::render(built);
    size_t compared = 0;
    built.integrator = std::make_shared<const Comparing>(&compared);
    const auto image = test::render(built, 0, 1).image;
    EXPECT_EQ(compared, 15u * 7 * 11);
    EXPECT_TRUE(std::equal(image.pixels.begin(), image.pixels.end(), truth.image.pixels.begin()));
}

} // namespace
} // namespace strobe
