// Direct light from spheres, disks and quads, still and moving, through the whole renderer against closed
// forms.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <functional>

namespace strobe {
namespace {

using Imath::V3d;

// The shaded point is the origin of a floor whose normal is +z. The camera looks down from z = 1: whatever is
// higher up lights the floor and is not seen.

/// Irradiance of unit radiance from a sphere that may dip below the horizon (Snyder 1996, "Area light sources
/// for real-time graphics", whole and clipped).
double sphere(const V3d& center, double radius) {
    const double d = center.length(), mu = center.z / d, s2 = radius * radius / (d * d);
    if (mu * mu > s2)
        return mu > 0 ? M_PI * s2 * mu : 0;
    const double q = 1 / s2 - 1, k = std::sqrt(1 - mu * mu / s2);
    return s2 * (mu * std::acos(-mu * std::sqrt(q / (1 - mu * mu))) - k * std::sqrt(q)) +
           std::atan(k / std::sqrt(q));
}

/// Of a disk parallel to the floor at height h, its center at distance a from the point's normal.
double disk(double h, double radius, double a) {
    const double h2 = h * h, r2 = radius * radius, a2 = a * a, z = a2 + h2 + r2;
    return M_PI / 2 * (1 - (a2 + h2 - r2) / std::sqrt(z * z - 4 * r2 * a2));
}

/// Of a polygon, whichever way it faces: Lambert's formula for the part above the horizon.
double polygon(const std::vector<V3d>& corners) {
    std::vector<V3d> above; // clipped at z = 0
    for (size_t i = 0; i < corners.size(); ++i) {
        const V3d &a = corners[i], &b = corners[(i + 1) % corners.size()];
        if (a.z >= 0)
            above.push_back(a);
        if ((a.z < 0) != (b.z < 0))
            above.push_back(a + (b - a) * (a.z / (a.z - b.z)));
    }
    double sum = 0;
    for (size_t i = 0; i < above.size(); ++i) {
        const V3d a = above[i].normalized(), b = above[(i + 1) % above.size()].normalized();
        const V3d normal = a.cross(b);
        if (normal.length() > 0)
            sum += std::acos(std::clamp(a.dot(b), -1.0, 1.0)) * normal.z / normal.length();
    }
    return std::abs(sum) / 2;
}

/// The mean over the shutter of what is smooth in time.
double overShutter(const std::function<double(double)>& irradiance) {
    constexpr int kSteps = 2000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        sum += irradiance((i + .5) / kSteps);
    return sum / kSteps;
}

struct LightCase {
    const char* name;
    std::string world;
    double irradiance; ///< for a radiance of 1
};
void PrintTo(const LightCase& light, std::ostream* out) { *out << light.name; }

const std::string kSphere = "Shape \"sphere\" \"float radius\" ";
const std::string kDisk = "Shape \"disk\" \"float radius\" ";
/// A quad of 2 by 1.2 in its own plane z = 0, facing +z.
const std::string kQuad = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] "
                          "\"point P\" [-1 -.6 0  1 -.6 0  1 .6 0  -1 .6 0]\n";
const std::string kTwoSided =
    "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"integer nsamples\" 2 \"bool twosided\" true\n";
const std::string kFaceDown = "Rotate 180 1 0 0\n";
const std::string kLater = "ActiveTransform EndTime\n", kAlways = "ActiveTransform All\n";

/// The corners of kQuad turned by `degrees` about x and put at `center`.
std::vector<V3d> quadAt(const V3d& center, double degrees) {
    const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
    std::vector<V3d> corners;
    for (const V3d& p : {V3d(-1, -.6, 0), V3d(1, -.6, 0), V3d(1, .6, 0), V3d(-1, .6, 0)})
        corners.push_back(center + V3d(p.x, c * p.y, s * p.y));
    return corners;
}

std::vector<LightCase> stillCases() {
    return {
        {"SphereAbove", "Translate 0 0 4\n" + kSphere + "1\n", sphere({0, 0, 4}, 1)},
        {"SphereAside", "Translate 3 1 2\n" + kSphere + ".5\n", sphere({3, 1, 2}, .5)},
        {"SphereTinyAndFar", "Translate 300 100 200\n" + kSphere + ".5\n", sphere({300, 100, 200}, .5)},
        {"SphereNear", "Translate 2 0 2\n" + kSphere + "1.4\n", sphere({2, 0, 2}, 1.4)},
        {"SphereAcrossTheHorizon", "Translate 3 0 .4\n" + kSphere + "1\n", sphere({3, 0, .4}, 1)},
        {"SphereMostlyBelow", "Translate 3 0 -.4\n" + kSphere + "1\n", sphere({3, 0, -.4}, 1)},
        {"SphereInwardSeenFromOutside", "ReverseOrientation\nTranslate 0 0 4\n" + kSphere + "1\n", 0},
        {"SphereTwoSidedSeenFromOutside", kTwoSided + "Translate 0 0 4\n" + kSphere + "1\n",
         sphere({0, 0, 4}, 1)},
        {"SphereInwardSeenFromInside", "ReverseOrientation\nTranslate .5 .3 .2\n" + kSphere + "9\n", M_PI},
        {"SphereTwoSidedSeenFromInside", kTwoSided + "Translate .5 .3 .2\n" + kSphere + "9\n", M_PI},
        {"SphereOutwardSeenFromInside", "Translate .5 .3 .2\n" + kSphere + "9\n", 0},
        {"SphereScaled", "Translate 0 2 3\nScale .5 .5 -.5\n" + kSphere + "2\n", sphere({0, 2, 3}, 1)},
        {"DiskOnAxis", "Translate 0 0 3\n" + kFaceDown + kDisk + "1.5\n", M_PI * 2.25 / (2.25 + 9)},
        {"DiskHuge", "Translate 0 0 3\n" + kFaceDown + kDisk + "90\n", M_PI * 8100 / (8100 + 9)},
        {"DiskAside", "Translate 2 -1 3\n" + kFaceDown + kDisk + "1.5\n", disk(3, 1.5, std::sqrt(5.))},
        {"DiskScaled", "Translate 2 -1 3\n" + kFaceDown + "Scale 3 3 7\n" + kDisk + ".5\n",
         disk(3, 1.5, std::sqrt(5.))},
        {"DiskFacingAway", "Translate 0 0 3\n" + kDisk + "1.5\n", 0},
        {"DiskReversed", "ReverseOrientation\nTranslate 0 0 3\n" + kDisk + "1.5\n", disk(3, 1.5, 0)},
        {"DiskTwoSided", kTwoSided + "Translate 0 0 3\n" + kDisk + "1.5\n", disk(3, 1.5, 0)},
        {"Ring",
         "Translate 0 0 3\n" + kFaceDown + "Shape \"disk\" \"float radius\" 2 \"float innerradius\" 1\n",
         disk(3, 2, 0) - disk(3, 1, 0)},
        {"QuadAbove", "Translate .3 .2 2.5\n" + kFaceDown + kQuad, polygon(quadAt({.3, .2, 2.5}, 0))},
        {"QuadTurned", "Translate 0 2 2\nRotate 140 1 0 0\n" + kQuad, polygon(quadAt({0, 2, 2}, 140))},
        {"QuadAcrossTheHorizon", "Translate 0 2 .1\nRotate 95 1 0 0\n" + kQuad,
         polygon(quadAt({0, 2, .1}, 95))},
        {"QuadFacingAway", "Translate .3 .2 2.5\n" + kQuad, 0},
        {"QuadTwoSided", kTwoSided + "Translate .3 .2 2.5\n" + kQuad, polygon(quadAt({.3, .2, 2.5}, 0))},
        {"QuadMirrored", "Translate .3 .2 2.5\n" + kFaceDown + "Scale -1 1 1\n" + kQuad,
         polygon(quadAt({.3, .2, 2.5}, 0))},
        {"TwoSpheres",
         "AttributeBegin\nTranslate 0 0 4\n" + kSphere + "1\nAttributeEnd\nTranslate 3 0 2\n" + kSphere +
             ".7\n",
         sphere({0, 0, 4}, 1) + sphere({3, 0, 2}, .7)},
    };
}

std::string inObject(const std::string& shape) { return "ObjectBegin \"lamp\"\n" + shape + "ObjectEnd\n"; }

std::vector<LightCase> movingCases() {
    const auto sphereOnItsWay = [](double t) { return sphere({-3 + 6 * t, 1, 3 - t}, 1); };
    const double movingSphere = overShutter(sphereOnItsWay);
    return {
        {"MovingSphere", "Translate -3 1 3\n" + kLater + "Translate 6 0 -1\n" + kAlways + kSphere + "1\n",
         movingSphere},
        {"GrowingSphere", "Translate 0 1 3\n" + kLater + "Scale 3 3 3\n" + kAlways + kSphere + ".5\n",
         overShutter([](double t) {
             return sphere({0, 1, 3}, .5 + t);
         })},
        {"SinkingSphere", "Translate 3 0 2\n" + kLater + "Translate 0 0 -4\n" + kAlways + kSphere + "1\n",
         overShutter([](double t) {
             return sphere({3, 0, 2 - 4 * t}, 1);
         })},
        {"FallingDisk",
         "Translate 0 0 5\n" + kLater + "Translate 0 0 -3.5\n" + kAlways + kFaceDown + kDisk + "1\n",
         overShutter([](double t) { return disk(5 - 3.5 * t, 1, 0); })},
        {"SlidingDisk",
         "Translate -2 0 2\n" + kLater + "Translate 4 0 0\n" + kAlways + kFaceDown + kDisk + "1\n",
         overShutter([](double t) { return disk(2, 1, std::abs(-2 + 4 * t)); })},
        {"TurningQuad",
         "Translate 0 0 2.5\n" + kLater + "Rotate 60 1 0 0\n" + kAlways + "Rotate 150 1 0 0\n" + kQuad,
         overShutter([](double t) {
             return polygon(quadAt({0, 0, 2.5}, 150 + 60 * t));
         })},
        {"TurningPastEdgeOn",
         "Translate 0 0 2.5\n" + kLater + "Rotate 170 1 0 0\n" + kAlways + "Rotate 150 1 0 0\n" + kQuad,
         overShutter([](double t) { // its back is dark
             const double degrees = 150 + 170 * t;
             return degrees < 270 ? polygon(quadAt({0, 0, 2.5}, degrees)) : 0;
         })},
        {"DeformingQuad",
         "Translate 0 0 2\nReverseOrientation\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] "
         "\"integer keys\" 2 \"point P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0  -2 -1 1 2 -1 1 2 1 1 -2 1 1]\n",
         overShutter([](double t) {
             const double x = 1 + t, z = 2 + t;
             return polygon({{-x, -1, z}, {x, -1, z}, {x, 1, z}, {-x, 1, z}});
         })},
        {"Instances",
         inObject(kSphere + "2\n") +
             "AttributeBegin\nTranslate 0 0 4\nScale .5 .5 .5\nObjectInstance \"lamp\"\n"
             "AttributeEnd\nTranslate 3 0 2\nScale .35 .35 .35\nObjectInstance \"lamp\"\n",
         sphere({0, 0, 4}, 1) + sphere({3, 0, 2}, .7)},
        {"InstanceOfDisk",
         inObject(kDisk + ".5\n") + "Translate 2 -1 3\n" + kFaceDown +
             "Scale 3 3 3\nObjectInstance \"lamp\"\n",
         disk(3, 1.5, std::sqrt(5.))},
        {"MovingInstance",
         inObject("Scale .5 .5 .5\n" + kSphere + "2\n") + "Translate -3 1 3\n" + kLater +
             "Translate 6 0 -1\n" + kAlways + "ObjectInstance \"lamp\"\n",
         movingSphere},
        {"MovingInsideAnInstance",
         inObject("Translate -3 0 0\n" + kLater + "Translate 6 0 -1\n" + kAlways + kSphere + "1\n") +
             "Translate 0 1 3\nObjectInstance \"lamp\"\n",
         movingSphere},
        {"MovingInsideAMovingInstance",
         inObject("Translate -1 0 0\n" + kLater + "Translate 2 0 -1\n" + kAlways + kSphere + "1\n") +
             "Translate -2 1 3\n" + kLater + "Translate 4 0 0\n" + kAlways + "ObjectInstance \"lamp\"\n",
         movingSphere},
        {"TurningInstanceOfQuad",
         inObject("Rotate 150 1 0 0\n" + kQuad) + "Translate 0 0 2.5\n" + kLater + "Rotate 60 1 0 0\n" +
             kAlways + "ObjectInstance \"lamp\"\n",
         overShutter([](double t) {
             return polygon(quadAt({0, 0, 2.5}, 150 + 60 * t));
         })},
    };
}

class DirectLight : public testing::TestWithParam<LightCase> {};

std::string sceneOf(const LightCase& light, const std::string& shading) {
    return "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n"
           "Sampler \"sobol\" \"integer pixelsamples\" 256\n" +
           shading +
           "\nLookAt 0 0 1  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-1e-4 1e-4 -1e-4 "
           "1e-4]\nWorldBegin\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
           "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-.1 -.1 0  .1 -.1 0  0 .2 0]\n"
           "Material \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n" +
           light.world;
}

TEST_P(DirectLight, EqualsTheClosedForm) {
    constexpr int kSeeds = 16;
    const double truth = .5 / M_PI * GetParam().irradiance;
    for (const char* shading : {"Integrator \"directlighting\"", "Integrator \"path\" \"integer maxdepth\" 1",
                                "Integrator \"path\" \"integer maxdepth\" 1 \"string strategy\" \"one\"",
                                "Integrator \"directlighting\" \"string strategy\" \"one\""}) {
        const auto [mean, error] = test::meanOverSeeds(test::build(sceneOf(GetParam(), shading)), kSeeds);
        // Rounding and the floor's finite spot give the 3e-5.
        EXPECT_NEAR(mean, truth, test::criticalZ(1, kSeeds) * error + 3e-5 * truth)
            << shading << " " << error;
        EXPECT_LE(error, 5e-3 * truth) << shading << ": too noisy to tell anything";
    }
}

std::string nameOf(const testing::TestParamInfo<LightCase>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Still, DirectLight, testing::ValuesIn(stillCases()), nameOf);
INSTANTIATE_TEST_SUITE_P(Moving, DirectLight, testing::ValuesIn(movingCases()), nameOf);

/// A normal is a cross product: it is squared to be made a unit long.
TEST(DirectLightOfAnySize, IsTheSame) {
    const auto image = [](const std::string& size, const char* integrator) {
        BuildOptions options;
        options.integrator = integrator;
        return test::render(
                   test::build("LookAt 0 -3" + size + " 2.5" + size +
                                   " 0 0 0 0 0 1\nCamera \"perspective\"\n"
                                   "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n"
                                   "Integrator \"directlighting\"\nWorldBegin\n"
                                   "LightSource \"distant\" \"point3 from\" [1 0 2]\n"
                                   "Shape \"trianglemesh\" \"point3 P\" [-9" +
                                   size + " -9" + size + " 0 9" + size + " -9" + size + " 0 0 9" + size +
                                   " 0] \"integer indices\" [0 1 2]\n",
                               options))
            .image.pixels;
    };
    for (const char* integrator : {"supersample", "msaa-cache"}) {
        const auto usual = image("", integrator);
        EXPECT_GT(usual[60].x, .1f);
        for (const char* size : {"e-12", "e-9", "e9", "e12"}) {
            const auto pixels = image(size, integrator);
            for (size_t i = 0; i < usual.size(); ++i)
                EXPECT_NEAR(pixels[i].x, usual[i].x, 1e-4f) << integrator << size << " " << i;
        }
    }
}

TEST(DirectLightForms, AgreeWithEachOther) {
    // The closed forms, where they meet: the test's own formulas must not lean on the renderer.
    EXPECT_NEAR(sphere({3, 0, 1.0001}, 1), sphere({3, 0, .9999}, 1), 1e-4); // touching the horizon, both ways
    EXPECT_NEAR(sphere({3, 0, 0}, 1), std::atan(1 / std::sqrt(8.)) - std::sqrt(8.) / 9, 1e-12);
    EXPECT_NEAR(disk(3, 1.5, 0), M_PI * 2.25 / (2.25 + 9), 1e-12);
    std::vector<V3d> circle;
    for (int i = 0; i < 4000; ++i)
        circle.emplace_back(2 + 1.5 * std::cos(i * M_PI / 2000), 1.5 * std::sin(i * M_PI / 2000), 3);
    EXPECT_NEAR(polygon(circle), disk(3, 1.5, 2), 1e-6);
}

} // namespace
} // namespace strobe
