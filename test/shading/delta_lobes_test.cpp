// Materials that have delta lobes only are followed as mirrors are.
#include "shading/scene_template.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Builds a scene of black lamps that are seen by way of `material`: in a mirror, or through a wall.
BuiltScene lampSeenBy(const std::string& material, const std::string& shading,
                      const std::string& integrator = "supersample") {
    const std::string scene =
        test::substitute(R"(
Film "image" "integer xresolution" 4 "integer yresolution" 4
Sampler "sobol" "integer pixelsamples" 64
Integrator "$shading"
Integrator "$integrator"
Camera "perspective" "float fov" 20
WorldBegin
Material "matte" "rgb Kd" [0 0 0]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [2 2 2] "bool twosided" true
  Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 -4  9 -9 -4  9 9 -4  -9 9 -4]
  Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 8  9 -9 8  9 9 8  -9 9 8]
AttributeEnd
Material $material
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 4  9 -9 4  9 9 4  -9 9 4]
)",
                         {{"$material", material}, {"$shading", shading}, {"$integrator", integrator}});
    Diagnostics quiet;
    return buildScene(parseText(scene, "t.scene", {"supersample", "indirect-cache"}, quiet), {}, quiet);
}

float centerOf(const BuiltScene& built) { return test::render(built).image.at(2, 2).x; }

TEST(DeltaLobes, AreFollowedByAllShaders) {
    for (const char* shading : {"path", "directlighting"}) {
        const auto seenBy = [&](const char* material) { return centerOf(lampSeenBy(material, shading)); };
        EXPECT_NEAR(seenBy(R"("mirror" "rgb Kr" [.8 .8 .8])"), 1.6f, 1e-3f) << shading;
        EXPECT_NEAR(seenBy(R"("metallicroughness" "rgb basecolor" [.8 .8 .8] "float roughness" 0)"), 1.6f,
                    1e-3f)
            << shading;
        // .96 of the light through the pane, .04 reflected:
        EXPECT_NEAR(
            seenBy(R"("metallicroughness" "float metallic" 0 "float transmission" 1 "float roughness" 0)"), 2,
            .01f)
            << shading;
    }
}

constexpr const char* kBlackVarnish =
    R"("metallicroughness" "rgb basecolor" [0 0 0] "float metallic" 0 "float roughness" 0)";
constexpr const char* kGrayVarnish =
    R"("metallicroughness" "rgb basecolor" [.5 .5 .5] "float metallic" 0 "float roughness" 0)";
constexpr const char* kCoat = R"("metallicroughness" "rgb basecolor" [.5 .5 .5] "float clearcoat" 1)";

TEST(DeltaLobes, OfVarnishReflectLampsWithAllShadersAndIntegrators) {
    for (const char* shading : {"path", "directlighting"})
        for (const char* integrator : {"supersample", "indirect-cache"})
            EXPECT_NEAR(centerOf(lampSeenBy(kBlackVarnish, shading, integrator)), .08f, 1e-3f)
                << shading << ' ' << integrator;
}

/// Black lamps reflect nothing, so that the light of the first vertex is direct.
TEST(DeltaLobes, BesideOthersAddUpWithAllShaders) {
    for (const char* material : {kGrayVarnish, kCoat}) {
        constexpr int kSeeds = 16;
        const auto path = test::renderSeeds(lampSeenBy(material, "path"), kSeeds);
        const auto direct = test::renderSeeds(lampSeenBy(material, "directlighting"), kSeeds);
        EXPECT_GT(path.meanOf(2, 2), .1);
        EXPECT_NEAR(path.meanOf(2, 2), direct.meanOf(2, 2),
                    4 * std::hypot(path.errorOf(2, 2), direct.errorOf(2, 2)))
            << material;
    }
}

} // namespace
} // namespace strobe
