// Materials that have delta lobes only are followed as mirrors are.
#include "shading/scene_template.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Returns the center of an image of a lamp that is seen by way of `material`: in a mirror, or through a
/// wall.
Rgb lampSeenBy(const std::string& material, const std::string& shading) {
    const std::string scene = test::substitute(R"(
Film "image" "integer xresolution" 4 "integer yresolution" 4
Sampler "sobol" "integer pixelsamples" 64
Integrator "$shading"
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
                                               {{"$material", material}, {"$shading", shading}});
    return test::render(test::build(scene)).image.at(2, 2);
}

TEST(DeltaLobes, AreFollowedByAllShaders) {
    for (const char* shading : {"path", "directlighting"}) {
        const Rgb mirrored = lampSeenBy(R"("mirror" "rgb Kr" [.8 .8 .8])", shading);
        EXPECT_NEAR(mirrored.x, 1.6f, 1e-3f) << shading;
        const Rgb metal =
            lampSeenBy(R"("metallicroughness" "rgb basecolor" [.8 .8 .8] "float roughness" 0)", shading);
        EXPECT_NEAR(metal.x, 1.6f, 1e-3f) << shading;
        const Rgb pane = lampSeenBy(
            R"("metallicroughness" "float metallic" 0 "float transmission" 1 "float roughness" 0)", shading);
        EXPECT_NEAR(pane.x, 2, .01f) << shading; // .96 of it through the pane, .04 reflected
    }
}

} // namespace
} // namespace strobe
