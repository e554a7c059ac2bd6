// Irradiance from sphere, disk and quad lights, static and moving, rendered and compared with closed forms.
#include "shading/closed_forms.h"
#include "shading/scene_template.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using namespace test;

// The closed forms are those of the floor at the origin. The camera looks down from z = 1, so that it
// does not see the lights, which are higher.

struct LightCase {
    const char* name;
    std::string lights; ///< scene text
    double irradiance;  ///< for a radiance of 1
};
void PrintTo(const LightCase& light, std::ostream* out) { *out << light.name; }

/// A quad of 2 by 1.2 in the plane z = 0, facing +z.
const std::string kQuad = R"(
    Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-1 -.6 0  1 -.6 0  1 .6 0  -1 .6 0]
)";
const std::string kTwoSided = R"(
    AreaLightSource "diffuse" "rgb L" [1 1 1] "integer nsamples" 2 "bool twosided" true
)";

/// Returns the corners of kQuad, turned by `degrees` about x and moved to `center`.
std::vector<V3d> quadAt(const V3d& center, double degrees) {
    const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
    std::vector<V3d> corners;
    for (const V3d& p : {V3d(-1, -.6, 0), V3d(1, -.6, 0), V3d(1, .6, 0), V3d(-1, .6, 0)})
        corners.push_back(center + V3d(p.x, c * p.y, s * p.y));
    return corners;
}

// "Rotate 180 1 0 0" turns a disk or quad to face the floor.

std::vector<LightCase> staticSpheres() {
    return {
        {"SphereAbove", R"(Translate 0 0 4  Shape "sphere" "float radius" 1)",
         sphereIrradiance({0, 0, 4}, 1)},
        {"SphereAside", R"(Translate 3 1 2  Shape "sphere" "float radius" .5)",
         sphereIrradiance({3, 1, 2}, .5)},
        {"SphereTinyAndFar", R"(Translate 300 100 200  Shape "sphere" "float radius" .5)",
         sphereIrradiance({300, 100, 200}, .5)},
        {"SphereNear", R"(Translate 2 0 2  Shape "sphere" "float radius" 1.4)",
         sphereIrradiance({2, 0, 2}, 1.4)},
        {"SphereAcrossTheHorizon", R"(Translate 3 0 .4  Shape "sphere" "float radius" 1)",
         sphereIrradiance({3, 0, .4}, 1)},
        {"SphereMostlyBelow", R"(Translate 3 0 -.4  Shape "sphere" "float radius" 1)",
         sphereIrradiance({3, 0, -.4}, 1)},
        {"SphereInwardSeenFromOutside",
         R"(ReverseOrientation  Translate 0 0 4  Shape "sphere" "float radius" 1)", 0},
        {"SphereTwoSidedSeenFromOutside", kTwoSided + R"(Translate 0 0 4  Shape "sphere" "float radius" 1)",
         sphereIrradiance({0, 0, 4}, 1)},
        {"SphereInwardSeenFromInside",
         R"(ReverseOrientation  Translate .5 .3 .2  Shape "sphere" "float radius" 9)", M_PI},
        {"SphereTwoSidedSeenFromInside", kTwoSided + R"(Translate .5 .3 .2  Shape "sphere" "float radius" 9)",
         M_PI},
        {"SphereOutwardSeenFromInside", R"(Translate .5 .3 .2  Shape "sphere" "float radius" 9)", 0},
        {"SphereScaled", R"(Translate 0 2 3  Scale .5 .5 -.5  Shape "sphere" "float radius" 2)",
         sphereIrradiance({0, 2, 3}, 1)},
        {"TwoSpheres", R"(
            AttributeBegin
              Translate 0 0 4
              Shape "sphere" "float radius" 1
            AttributeEnd
            Translate 3 0 2
            Shape "sphere" "float radius" .7
         )",
         sphereIrradiance({0, 0, 4}, 1) + sphereIrradiance({3, 0, 2}, .7)},
    };
}

std::vector<LightCase> staticDisksAndQuads() {
    const double aside = std::sqrt(5.);
    return {
        {"DiskOnAxis", R"(Translate 0 0 3  Rotate 180 1 0 0  Shape "disk" "float radius" 1.5)",
         M_PI * 2.25 / (2.25 + 9)},
        {"DiskHuge", R"(Translate 0 0 3  Rotate 180 1 0 0  Shape "disk" "float radius" 90)",
         M_PI * 8100 / (8100 + 9)},
        {"DiskAside", R"(Translate 2 -1 3  Rotate 180 1 0 0  Shape "disk" "float radius" 1.5)",
         diskIrradiance(3, 1.5, aside)},
        {"DiskScaled", R"(Translate 2 -1 3  Rotate 180 1 0 0  Scale 3 3 7  Shape "disk" "float radius" .5)",
         diskIrradiance(3, 1.5, aside)},
        {"DiskFacingAway", R"(Translate 0 0 3  Shape "disk" "float radius" 1.5)", 0},
        {"DiskReversed", R"(ReverseOrientation  Translate 0 0 3  Shape "disk" "float radius" 1.5)",
         diskIrradiance(3, 1.5, 0)},
        {"DiskTwoSided", kTwoSided + R"(Translate 0 0 3  Shape "disk" "float radius" 1.5)",
         diskIrradiance(3, 1.5, 0)},
        {"Ring", R"(Translate 0 0 3  Rotate 180 1 0 0  Shape "disk" "float radius" 2 "float innerradius" 1)",
         diskIrradiance(3, 2, 0) - diskIrradiance(3, 1, 0)},
        {"QuadAbove", "Translate .3 .2 2.5  Rotate 180 1 0 0" + kQuad,
         polygonIrradiance(quadAt({.3, .2, 2.5}, 0))},
        {"QuadTurned", "Translate 0 2 2  Rotate 140 1 0 0" + kQuad,
         polygonIrradiance(quadAt({0, 2, 2}, 140))},
        {"QuadAcrossTheHorizon", "Translate 0 2 .1  Rotate 95 1 0 0" + kQuad,
         polygonIrradiance(quadAt({0, 2, .1}, 95))},
        {"QuadFacingAway", "Translate .3 .2 2.5" + kQuad, 0},
        {"QuadTwoSided", kTwoSided + "Translate .3 .2 2.5" + kQuad,
         polygonIrradiance(quadAt({.3, .2, 2.5}, 0))},
        {"QuadMirrored", "Translate .3 .2 2.5  Rotate 180 1 0 0  Scale -1 1 1" + kQuad,
         polygonIrradiance(quadAt({.3, .2, 2.5}, 0))},
    };
}

std::vector<LightCase> movingSpheres() {
    return {
        {"MovingSphere", R"(
            Translate -3 1 3
            ActiveTransform EndTime
            Translate 6 0 -1
            ActiveTransform All
            Shape "sphere" "float radius" 1
         )",
         meanOverShutter([](double t) {
             return sphereIrradiance({-3 + 6 * t, 1, 3 - t}, 1);
         })},
        {"GrowingSphere", R"(
            Translate 0 1 3
            ActiveTransform EndTime
            Scale 3 3 3
            ActiveTransform All
            Shape "sphere" "float radius" .5
         )",
         meanOverShutter([](double t) {
             return sphereIrradiance({0, 1, 3}, .5 + t);
         })},
        {"SinkingSphere", R"(
            Translate 3 0 2
            ActiveTransform EndTime
            Translate 0 0 -4
            ActiveTransform All
            Shape "sphere" "float radius" 1
         )",
         meanOverShutter([](double t) {
             return sphereIrradiance({3, 0, 2 - 4 * t}, 1);
         })},
    };
}

std::vector<LightCase> movingDisksAndQuads() {
    return {
        {"FallingDisk", R"(
            Translate 0 0 5
            ActiveTransform EndTime
            Translate 0 0 -3.5
            ActiveTransform All
            Rotate 180 1 0 0
            Shape "disk" "float radius" 1
         )",
         meanOverShutter([](double t) { return diskIrradiance(5 - 3.5 * t, 1, 0); })},
        {"SlidingDisk", R"(
            Translate -2 0 2
            ActiveTransform EndTime
            Translate 4 0 0
            ActiveTransform All
            Rotate 180 1 0 0
            Shape "disk" "float radius" 1
         )",
         meanOverShutter([](double t) { return diskIrradiance(2, 1, std::abs(-2 + 4 * t)); })},
        {"TurningQuad", R"(
            Translate 0 0 2.5
            ActiveTransform EndTime
            Rotate 60 1 0 0
            ActiveTransform All
            Rotate 150 1 0 0
         )" + kQuad,
         meanOverShutter([](double t) {
             return polygonIrradiance(quadAt({0, 0, 2.5}, 150 + 60 * t));
         })},
        {"QuadTurningPastEdgeOn", R"(
            Translate 0 0 2.5
            ActiveTransform EndTime
            Rotate 170 1 0 0
            ActiveTransform All
            Rotate 150 1 0 0
         )" + kQuad,
         meanOverShutter([](double t) { // the back does not emit
             const double degrees = 150 + 170 * t;
             return degrees < 270 ? polygonIrradiance(quadAt({0, 0, 2.5}, degrees)) : 0;
         })},
        {"DeformingQuad", R"(
            Translate 0 0 2
            ReverseOrientation
            Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "integer keys" 2
              "point P" [-1 -1 0  1 -1 0  1 1 0  -1 1 0   -2 -1 1  2 -1 1  2 1 1  -2 1 1]
         )",
         meanOverShutter([](double t) {
             const double x = 1 + t, z = 2 + t;
             return polygonIrradiance({{-x, -1, z}, {x, -1, z}, {x, 1, z}, {-x, 1, z}});
         })},
    };
}

std::vector<LightCase> staticInstances() {
    return {
        {"TwoInstances", R"(
            ObjectBegin "lamp"
              Shape "sphere" "float radius" 2
            ObjectEnd
            AttributeBegin
              Translate 0 0 4
              Scale .5 .5 .5
              ObjectInstance "lamp"
            AttributeEnd
            Translate 3 0 2
            Scale .35 .35 .35
            ObjectInstance "lamp"
         )",
         sphereIrradiance({0, 0, 4}, 1) + sphereIrradiance({3, 0, 2}, .7)},
        {"InstanceOfDisk", R"(
            ObjectBegin "lamp"
              Shape "disk" "float radius" .5
            ObjectEnd
            Translate 2 -1 3
            Rotate 180 1 0 0
            Scale 3 3 3
            ObjectInstance "lamp"
         )",
         diskIrradiance(3, 1.5, std::sqrt(5.))},
    };
}

std::vector<LightCase> movingInstances() {
    const double movingSphere = meanOverShutter([](double t) {
        return sphereIrradiance({-3 + 6 * t, 1, 3 - t}, 1);
    });
    return {
        {"MovingInstance", R"(
            ObjectBegin "lamp"
              Scale .5 .5 .5
              Shape "sphere" "float radius" 2
            ObjectEnd
            Translate -3 1 3
            ActiveTransform EndTime
            Translate 6 0 -1
            ActiveTransform All
            ObjectInstance "lamp"
         )",
         movingSphere},
        {"MovingSphereInInstance", R"(
            ObjectBegin "lamp"
              Translate -3 0 0
              ActiveTransform EndTime
              Translate 6 0 -1
              ActiveTransform All
              Shape "sphere" "float radius" 1
            ObjectEnd
            Translate 0 1 3
            ObjectInstance "lamp"
         )",
         movingSphere},
        {"MovingSphereInMovingInstance", R"(
            ObjectBegin "lamp"
              Translate -1 0 0
              ActiveTransform EndTime
              Translate 2 0 -1
              ActiveTransform All
              Shape "sphere" "float radius" 1
            ObjectEnd
            Translate -2 1 3
            ActiveTransform EndTime
            Translate 4 0 0
            ActiveTransform All
            ObjectInstance "lamp"
         )",
         movingSphere},
        {"TurningInstanceOfQuad", R"(
            ObjectBegin "lamp"
              Rotate 150 1 0 0
         )" + kQuad + R"(
            ObjectEnd
            Translate 0 0 2.5
            ActiveTransform EndTime
            Rotate 60 1 0 0
            ActiveTransform All
            ObjectInstance "lamp"
         )",
         meanOverShutter([](double t) {
             return polygonIrradiance(quadAt({0, 0, 2.5}, 150 + 60 * t));
         })},
    };
}

class DirectLightTest : public testing::TestWithParam<LightCase> {};

/// Returns the scene of a gray floor under lights of radiance 1 that reflect nothing.
std::string sceneOf(const LightCase& light, const std::string& integrator) {
    const char* scene = R"(
        Film "image" "integer xresolution" 4 "integer yresolution" 4
        Sampler "sobol" "integer pixelsamples" 256
        Integrator $integrator
        LookAt 0 0 1  0 0 0  0 1 0
        Camera "orthographic" "float screenwindow" [-1e-4 1e-4 -1e-4 1e-4]
        WorldBegin
        Material "matte" "rgb Kd" [.5 .5 .5]
        Shape "trianglemesh" "integer indices" [0 1 2] "point P" [-.1 -.1 0  .1 -.1 0  0 .2 0]
        Material "matte" "rgb Kd" [0 0 0]
        AreaLightSource "diffuse" "rgb L" [1 1 1]
        $lights
    )";
    return substitute(scene, {{"$integrator", integrator}, {"$lights", light.lights}});
}

TEST_P(DirectLightTest, EqualsTheClosedForm) {
    constexpr int kSeeds = 16;
    const double expected = .5 / M_PI * GetParam().irradiance;
    for (const char* integrator : {R"("directlighting")", R"("path" "integer maxdepth" 1)",
                                   R"("path" "integer maxdepth" 1 "string strategy" "one")",
                                   R"("directlighting" "string strategy" "one")"}) {
        const auto [mean, error] = test::meanOverSeeds(test::build(sceneOf(GetParam(), integrator)), kSeeds);
        // The relative tolerance of 3e-5 covers rounding and the finite size of the visible floor.
        EXPECT_NEAR(mean, expected, test::criticalZ(1, kSeeds) * error + 3e-5 * expected)
            << integrator << " " << error;
        EXPECT_LE(error, 5e-3 * expected) << integrator << ": noise hides any bias";
    }
}

std::string nameOf(const testing::TestParamInfo<LightCase>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(StaticSpheres, DirectLightTest, testing::ValuesIn(staticSpheres()), nameOf);
INSTANTIATE_TEST_SUITE_P(StaticDisksAndQuads, DirectLightTest, testing::ValuesIn(staticDisksAndQuads()),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(StaticInstances, DirectLightTest, testing::ValuesIn(staticInstances()), nameOf);
INSTANTIATE_TEST_SUITE_P(MovingSpheres, DirectLightTest, testing::ValuesIn(movingSpheres()), nameOf);
INSTANTIATE_TEST_SUITE_P(MovingDisksAndQuads, DirectLightTest, testing::ValuesIn(movingDisksAndQuads()),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(MovingInstances, DirectLightTest, testing::ValuesIn(movingInstances()), nameOf);

/// Returns the scene of a triangle under a distant light. `exponent` is appended to all lengths: "e-9" scales
/// the scene by 1e-9.
std::string scaledScene(const std::string& exponent) {
    const char* scene = R"(
        LookAt 0 -3$e 2.5$e  0 0 0  0 0 1
        Camera "perspective"
        Film "image" "integer xresolution" 8 "integer yresolution" 8
        Integrator "directlighting"
        WorldBegin
        LightSource "distant" "point3 from" [1 0 2]
        Shape "trianglemesh" "integer indices" [0 1 2] "point3 P" [-9$e -9$e 0  9$e -9$e 0  0 9$e 0]
    )";
    return substitute(scene, {{"$e", exponent}});
}

/// The normal of a triangle is a cross product, whose squared length may neither underflow nor overflow.
TEST(DirectLight, DoesNotDependOnTheScaleOfTheScene) {
    const auto image = [](const std::string& exponent, const char* integrator) {
        BuildOptions options;
        options.integrator = integrator;
        return test::render(test::build(scaledScene(exponent), options)).image.pixels;
    };
    for (const char* integrator : {"supersample", "msaa-cache"}) {
        const auto expected = image("", integrator);
        EXPECT_GT(expected[60].x, .1f);
        for (const char* exponent : {"e-12", "e-9", "e9", "e12"}) {
            const auto pixels = image(exponent, integrator);
            for (size_t i = 0; i < expected.size(); ++i)
                EXPECT_NEAR(pixels[i].x, expected[i].x, 1e-4f) << integrator << exponent << " " << i;
        }
    }
}

/// Checks the closed forms against each other, without the renderer.
TEST(DirectLightClosedForms, AgreeWithEachOther) {
    // A sphere that touches the horizon, from both sides.
    EXPECT_NEAR(sphereIrradiance({3, 0, 1.0001}, 1), sphereIrradiance({3, 0, .9999}, 1), 1e-4);
    EXPECT_NEAR(sphereIrradiance({3, 0, 0}, 1), std::atan(1 / std::sqrt(8.)) - std::sqrt(8.) / 9, 1e-12);
    EXPECT_NEAR(diskIrradiance(3, 1.5, 0), M_PI * 2.25 / (2.25 + 9), 1e-12);
    std::vector<V3d> circle;
    for (int i = 0; i < 4000; ++i)
        circle.emplace_back(2 + 1.5 * std::cos(i * M_PI / 2000), 1.5 * std::sin(i * M_PI / 2000), 3);
    EXPECT_NEAR(polygonIrradiance(circle), diskIrradiance(3, 1.5, 2), 1e-6);
}

} // namespace
} // namespace strobe
