// indirect-cache against supersample, and the two parts of light against the whole.
#include "integrators/supersample.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

// A corner with a texture, a moving ball, a mirror, an area light and a sky: every kind of light on every
// kind of path.
std::string scene(const std::string& shading = "\"path\" \"integer maxdepth\" 4") {
    return "Film \"image\" \"integer xresolution\" 32 \"integer yresolution\" 24\n"
           "Sampler \"sobol\" \"integer pixelsamples\" 16\nIntegrator " +
           shading +
           "\nLookAt 0 2 -6 0 .7 0 0 1 0\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\n"
           "LightSource \"infinite\" \"rgb L\" [.2 .25 .3]\n"
           "AttributeBegin\nTranslate 2 3 -2\nAreaLightSource \"diffuse\" \"rgb L\" [12 12 12]\nShape "
           "\"sphere\" \"float radius\" .8\nAttributeEnd\n"
           "Material \"matte\" \"rgb Kd\" [.8 .7 .5]\n"
           "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 "
           "9]\n"
           "Texture \"c\" \"rgb\" \"checkerboard\" \"rgb tex1\" [.2 .3 .2] \"rgb tex2\" [.9 .8 .7]\n"
           "Material \"matte\" \"texture Kd\" \"c\"\n"
           "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 0 2 9 0 2 9 9 2 -9 9 "
           "2] \"point2 uv\" [0 0 16 0 16 8 0 8]\n"
           "AttributeBegin\nMaterial \"plastic\" \"float roughness\" .1\nTranslate -1.2 1 0\nActiveTransform "
           "EndTime\nTranslate .5 0 0\nActiveTransform All\nShape \"sphere\" \"float radius\" "
           ".7\nAttributeEnd\n"
           "AttributeBegin\nMaterial \"mirror\"\nTranslate 1.2 .8 .5\nShape \"sphere\" \"float radius\" .7\n"
           "AttributeEnd\n";
}

BuiltScene build(const std::string& text, const std::string& integrator,
                 std::vector<std::string> defines = {}) {
    BuildOptions options;
    options.integrator = integrator;
    options.defines = std::move(defines);
    return test::build(text, options);
}

bool sameBits(const Image& a, const Image& b) {
    return !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

/// Asks for the light of each sample in components, where it may.
class ComponentsWorker : public IntegratorWorker {
  public:
    explicit ComponentsWorker(const Scene& scene) : m_scene(scene) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_first.clear();
        for (const VisibilitySample& s : batch.samples) {
            ShadingRequest r = requestFor(m_scene, batch, s);
            m_first.push_back(requests.size());
            const bool smooth =
                s.hit && m_scene.materials()[size_t(m_scene.geometry(s.hit).material)]->flags().smooth;
            if (!smooth) {
                requests.push_back(r);
                continue;
            }
            for (const LightComponent component :
                 {LightComponent::Direct, LightComponent::Indirect, LightComponent::Albedo}) {
                r.component = component;
                requests.push_back(r);
            }
        }
        m_first.push_back(requests.size());
    }
    std::span<const Rgb> resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i) {
            const Rgb* component = &shaded[m_first[i]];
            values[i] = component[0];
            if (m_first[i + 1] == m_first[i] + 1)
                continue;
            const Material& material =
                *m_scene.materials()[size_t(m_scene.geometry(batch.samples[i].hit).material)];
            values[i] += material.flags().textured ? component[1] * component[2] : component[1];
        }
        return values;
    }

  private:
    const Scene& m_scene;
    std::vector<size_t> m_first; ///< of each sample's requests, and one more
};

class Components : public Integrator {
  public:
    BiasBound biasBound(const Scene&) const override { return {}; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<ComponentsWorker>>(scene);
    }
};

void expectSameMeans(const BuiltScene& a, const BuiltScene& b, const std::string& what) {
    constexpr int kSeeds = 64;
    const auto truth = test::renderSeeds(a, kSeeds, 100), other = test::renderSeeds(b, kSeeds, 900);
    const double z = test::criticalZ(truth.mean.size(), kSeeds);
    for (size_t i = 0; i < truth.mean.size(); ++i)
        EXPECT_NEAR(other.mean[i], truth.mean[i], z * std::hypot(other.error[i], truth.error[i]) + 1e-5)
            << what << ' ' << i;
}

TEST(LightComponents, AddUpToAll) {
    for (const char* strategy : {"strategy=all", "strategy=one"}) {
        BuiltScene components = build(scene(), "supersample", {strategy});
        components.integrator = std::make_shared<const Components>();
        expectSameMeans(build(scene(), "supersample", {strategy}), components, strategy);
    }
}

TEST(LightComponents, OfASingleSurfaceAreDirect) {
    BuiltScene components = build(scene("\"directlighting\""), "supersample");
    EXPECT_FALSE(components.shader->hasIndirectLight());
    EXPECT_TRUE(build(scene(), "supersample").shader->hasIndirectLight());
    components.integrator = std::make_shared<const Components>();
    EXPECT_TRUE(sameBits(test::render(components).image,
                         test::render(build(scene("\"directlighting\""), "supersample")).image));
}

TEST(IndirectCache, WhereNothingIsSharedIsSupersample) {
    EXPECT_TRUE(sameBits(test::render(build(scene(), "supersample")).image,
                         test::render(build(scene(), "indirect-cache", {"blocksize=0"})).image));
    const std::string direct = scene("\"directlighting\"");
    EXPECT_TRUE(sameBits(test::render(build(direct, "supersample")).image,
                         test::render(build(direct, "indirect-cache")).image));
}

TEST(IndirectCache, SameBitsForAnyCacheThreadsAndTiles) {
    // Small blocks are more than a thread remembers: the cache has them.
    for (const char* extra : {"timebins=1", "timebins=3", "blocksize=0.25"}) {
        const BuiltScene built = build(scene(), "indirect-cache", {extra});
        const auto reference = test::render(built, 3, 1, 16);
        EXPECT_EQ(reference.stats.total.cacheHits > 0, extra == std::string("blocksize=0.25"));
        for (int threads : {2, 7})
            EXPECT_TRUE(sameBits(reference.image, test::render(built, 3, threads, 8).image)) << threads;
        for (const char* size : {"cache-mb=0", "cache-mb=0.001", "cache-mb=64"})
            EXPECT_TRUE(
                sameBits(reference.image,
                         test::render(build(scene(), "indirect-cache", {extra, size}), 3, 2, 64).image))
                << size;
    }
}

TEST(IndirectCache, FurnaceStaysOne) {
    for (const char* blocks : {"blocksize=1", "blocksize=4", "blocksize=64"}) {
        const BuiltScene built = build(
            "Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 12\n"
            "Sampler \"sobol\" \"integer pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 200\n"
            "Camera \"perspective\" \"float fov\" 90\nWorldBegin\nReverseOrientation\n"
            "AreaLightSource \"diffuse\" \"rgb L\" [.5 .5 .5]\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
            "Translate .3 .2 0\nShape \"sphere\" \"float radius\" 1\n",
            "indirect-cache", {blocks});
        const auto [mean, error] = test::meanOverSeeds(built, 32);
        EXPECT_NEAR(mean, 1, test::criticalZ(1, 32) * error) << blocks;
    }
}

TEST(IndirectCache, BiasFallsWithTheBlockAndShadesAreFew) {
    constexpr int kSeeds = 48;
    const auto truth = test::renderSeeds(build(scene(), "supersample"), kSeeds, 100);
    double last = kInfinity;
    for (const char* blocks : {"blocksize=8", "blocksize=2", "blocksize=0.5"}) {
        const auto shared = test::renderSeeds(build(scene(), "indirect-cache", {blocks}), kSeeds, 900);
        double bias2 = 0;
        for (size_t i = 0; i < truth.mean.size(); ++i) {
            const double d = shared.mean[i] - truth.mean[i];
            bias2 += d * d - shared.error[i] * shared.error[i] - truth.error[i] * truth.error[i];
        }
        bias2 /= double(truth.mean.size());
        EXPECT_LT(bias2, last) << blocks;
        last = bias2;
    }
    EXPECT_LT(std::sqrt(std::max(last, 0.0)), 0.005);
    const RenderStats stats = test::render(build(scene(), "indirect-cache", {"shades=1"})).stats;
    EXPECT_GT(stats.total.directShades, 4 * stats.total.shades);
}

} // namespace
} // namespace strobe
