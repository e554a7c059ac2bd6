// Shading requests for a whole batch equal those for single samples.
#include "core/render/integrator.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Shades every sample, and compares requestForEach with requestFor.
class ComparingWorker : public IntegratorWorker {
  public:
    ComparingWorker(const Scene& scene, size_t* compared) : m_scene(scene), m_compared(compared) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        requestForEach(m_scene, batch, requests);
        ASSERT_EQ(requests.size(), batch.samples.size());
        uint32_t i = 0;
        for (const VisibilitySample& sample : batch.samples) {
            const ShadingRequest single = requestFor(m_scene, batch, sample);
            const ShadingRequest batched = requests[i];
            EXPECT_EQ(single.sample, i++);
            EXPECT_EQ(batched.sample, single.sample);
            EXPECT_EQ(batched.hit.instance, single.hit.instance);
            EXPECT_EQ(batched.hit.geometry, single.hit.geometry);
            EXPECT_EQ(batched.hit.prim, single.hit.prim);
            EXPECT_EQ(batched.hit.u, single.hit.u);
            EXPECT_EQ(batched.hit.v, single.hit.v);
            EXPECT_EQ(batched.hit.t, single.hit.t);
            EXPECT_EQ(batched.ray.o, single.ray.o);
            EXPECT_EQ(batched.ray.d, single.ray.d);
            EXPECT_EQ(batched.ray.time, single.ray.time);
            EXPECT_EQ(batched.cone.width, single.cone.width);
            EXPECT_EQ(batched.cone.spread, single.cone.spread);
            EXPECT_EQ(batched.domain, single.domain);
            EXPECT_EQ(batched.index, single.index);
            EXPECT_EQ(batched.total, single.total);
            EXPECT_EQ(batched.component, single.component);
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

class ComparingIntegrator : public Integrator {
  public:
    explicit ComparingIntegrator(size_t* compared) : m_compared(compared) {}
    BiasBound biasBound(const Scene&) const override { return {}; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<ComparingWorker, size_t*>>(scene, m_compared);
    }

  private:
    size_t* m_compared;
};

TEST(Batch, RequestForEachEqualsRequestFor) {
    BuiltScene built = test::build(R"(
        Film "image" "integer xresolution" 15 "integer yresolution" 7
        Sampler "independent" "integer pixelsamples" 11
        Integrator "directlighting"
        Camera "perspective" "float lensradius" .1 "float focaldistance" 3
        WorldBegin
        LightSource "infinite"
        Texture "c" "rgb" "checkerboard"
        Material "matte" "texture Kd" "c"
        Translate 0 0 3
        Shape "sphere"
        )");
    ASSERT_TRUE(built.scene->needsFootprint());
    const Image reference = test::render(built).image;
    size_t compared = 0;
    built.integrator = std::make_shared<const ComparingIntegrator>(&compared);
    const auto image = test::render(built, 0, 1).image;
    EXPECT_EQ(compared, 15u * 7 * 11);
    EXPECT_TRUE(std::equal(image.pixels.begin(), image.pixels.end(), reference.pixels.begin()));
}

} // namespace
} // namespace strobe
