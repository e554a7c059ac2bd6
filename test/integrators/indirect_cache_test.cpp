// indirect-cache against supersample, and the components of light against the whole.
#include "integrators/sharing_support.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::buildWith;
using test::haveEqualBits;

/// A corner with a texture, a moving sphere, a mirror, an area light and a sky: all kinds of light on all
/// kinds of paths.
std::string makeScene(const std::string& integrator = R"("path" "integer maxdepth" 4)") {
    return R"(
Film "image" "integer xresolution" 32 "integer yresolution" 24
Sampler "sobol" "integer pixelsamples" 16
Integrator )" +
           integrator + R"(
LookAt 0 2 -6  0 .7 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "infinite" "rgb L" [.2 .25 .3]
AttributeBegin
  Translate 2 3 -2
  AreaLightSource "diffuse" "rgb L" [12 12 12]
  Shape "sphere" "float radius" .8
AttributeEnd
)" + test::kCorner;
}

const std::string kDirectLighting = "\"directlighting\"";

/// Requests each component of a sample's light by itself.
class ComponentsWorker : public IntegratorWorker {
  public:
    explicit ComponentsWorker(const Scene& scene) : m_scene(scene) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_firstRequest.clear();
        for (const VisibilitySample& s : batch.samples) {
            ShadingRequest request = requestFor(m_scene, batch, s);
            m_firstRequest.push_back(requests.size());
            if (!s.hit || !materialOf(s.hit).flags().smooth) {
                requests.push_back(request);
                continue;
            }
            for (const LightComponent component :
                 {LightComponent::Direct, LightComponent::Indirect, LightComponent::Albedo}) {
                request.component = component;
                requests.push_back(request);
            }
        }
        m_firstRequest.push_back(requests.size());
    }

    std::span<const Rgb> resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i) {
            const auto components =
                shaded.subspan(m_firstRequest[i], m_firstRequest[i + 1] - m_firstRequest[i]);
            values[i] = components[0];
            if (components.size() == 1)
                continue;
            const bool isTextured = materialOf(batch.samples[i].hit).flags().textured;
            values[i] += isTextured ? components[1] * components[2] : components[1];
        }
        return values;
    }

  private:
    const Material& materialOf(const Hit& hit) const {
        return *m_scene.materials()[size_t(m_scene.geometry(hit).material)];
    }

    const Scene& m_scene;
    std::vector<size_t> m_firstRequest; ///< by sample; the last is the number of requests
};

class Components : public Integrator {
  public:
    BiasBound biasBound(const Scene&) const override { return {}; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<ComponentsWorker>>(scene);
    }
};

TEST(LightComponents, SumToAllLight) {
    constexpr int kSeeds = 64;
    for (const char* strategy : {"strategy=all", "strategy=one"}) {
        const BuiltScene whole = buildWith("supersample", makeScene(), {strategy});
        BuiltScene components = buildWith("supersample", makeScene(), {strategy});
        components.integrator = std::make_shared<const Components>();
        const auto a = test::renderSeeds(whole, kSeeds, 100), b = test::renderSeeds(components, kSeeds, 900);
        const double z = test::criticalZ(a.mean.size(), kSeeds);
        for (size_t i = 0; i < a.mean.size(); ++i)
            EXPECT_NEAR(b.mean[i], a.mean[i], z * std::hypot(b.error[i], a.error[i]) + 1e-5)
                << strategy << ' ' << i;
    }
}

TEST(LightComponents, OfDirectLightingAreDirect) {
    const BuiltScene whole = buildWith("supersample", makeScene(kDirectLighting));
    EXPECT_FALSE(whole.shader->hasIndirectLight());
    EXPECT_TRUE(buildWith("supersample", makeScene()).shader->hasIndirectLight());
    BuiltScene components = buildWith("supersample", makeScene(kDirectLighting));
    components.integrator = std::make_shared<const Components>();
    EXPECT_TRUE(haveEqualBits(test::render(components).image, test::render(whole).image));
}

TEST(IndirectCache, IsSupersampleWhereNothingIsShared) {
    EXPECT_TRUE(haveEqualBits(test::render(buildWith("supersample", makeScene())).image,
                              test::render(buildWith("indirect-cache", makeScene(), {"blocksize=0"})).image));
    const std::string direct = makeScene(kDirectLighting);
    EXPECT_TRUE(haveEqualBits(test::render(buildWith("supersample", direct)).image,
                              test::render(buildWith("indirect-cache", direct)).image));
}

TEST(IndirectCache, BitsDoNotDependOnCacheSizeThreadsOrTiles) {
    for (const char* define : {"timebins=1", "timebins=3", "blocksize=0.25"}) {
        const BuiltScene built = buildWith("indirect-cache", makeScene(), {define});
        const auto reference = test::render(built, 3, 1, 16);
        // Small blocks exceed InterpolationTable: only these are looked up in the cache again.
        EXPECT_EQ(reference.stats.total.cacheHits > 0, define == std::string("blocksize=0.25"));
        for (int threads : {2, 7})
            EXPECT_TRUE(haveEqualBits(reference.image, test::render(built, 3, threads, 8).image)) << threads;
        for (const char* size : {"cache-mb=0", "cache-mb=0.001", "cache-mb=64"}) {
            const BuiltScene other = buildWith("indirect-cache", makeScene(), {define, size});
            EXPECT_TRUE(haveEqualBits(reference.image, test::render(other, 3, 2, 64).image)) << size;
        }
    }
}

TEST(IndirectCache, FurnaceHasRadianceOne) {
    for (const char* blockSize : {"blocksize=1", "blocksize=4", "blocksize=64"}) {
        const BuiltScene built = buildWith("indirect-cache", test::kFurnace, {blockSize});
        const auto [mean, error] = test::meanOverSeeds(built, 32);
        EXPECT_NEAR(mean, 1, test::criticalZ(1, 32) * error) << blockSize;
    }
}

TEST(IndirectCache, BiasFallsWithTheBlockSize) {
    constexpr int kSeeds = 96;
    const auto reference = test::renderSeeds(buildWith("supersample", makeScene()), kSeeds, 100);
    double lastBias2 = kInfinity;
    for (const char* blockSize : {"blocksize=8", "blocksize=2", "blocksize=0.5"}) {
        const auto shared =
            test::renderSeeds(buildWith("indirect-cache", makeScene(), {blockSize}), kSeeds, 900);
        const double bias2 = test::squaredBias(shared, reference);
        EXPECT_LT(bias2, lastBias2) << blockSize;
        lastBias2 = bias2;
    }
    EXPECT_LT(std::sqrt(std::max(lastBias2, 0.0)), 0.005);
}

TEST(IndirectCache, HasFewerIndirectThanDirectShades) {
    const RenderStats stats = test::render(buildWith("indirect-cache", makeScene(), {"shades=1"})).stats;
    EXPECT_GT(stats.total.directShades, 4 * stats.total.shades);
}

} // namespace
} // namespace strobe
