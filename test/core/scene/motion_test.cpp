// Motion blur, compared with closed forms and with averages of stills.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

TEST(Motion, CoverageOfAMovingBarIsTheTrapezoid) {
    // One world unit is one pixel; a bar of 6 pixels travels 10.
    const double left = -9.3, right = -3.3, distance = 10;
    const std::string text = R"(
        Film "image" "integer xresolution" 32 "integer yresolution" 2
        Sampler "independent" "integer pixelsamples" 256
        Integrator "directlighting"
        Camera "orthographic" "float screenwindow" [-16 16 -1 1]
        WorldBegin
        Material "matte" "rgb Kd" [0 0 0]
        AreaLightSource "diffuse" "rgb L" [1 1 1] "bool twosided" true
        Translate 0 0 5
        ActiveTransform EndTime
        Translate 10 0 0
        ActiveTransform All
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3]
          "point P" [-9.3 -5 0  -3.3 -5 0  -3.3 5 0  -9.3 5 0]
        )";
    const test::PixelStatistics s = test::renderSeeds(test::build(text), 32);
    const double z = test::criticalZ(64, 32);
    for (int x = 0; x < 32; ++x) {
        double coverage = 0;
        constexpr int kSteps = 20000;
        for (int i = 0; i < kSteps; ++i) {
            const double shift = distance * (i + .5) / kSteps + 16;
            coverage += std::max(0.0, std::min(x + 1.0, right + shift) - std::max(double(x), left + shift));
        }
        coverage /= kSteps;
        for (int y = 0; y < 2; ++y)
            EXPECT_NEAR(s.meanOf(x, y), coverage, z * s.errorOf(x, y) + 1e-5) << x;
    }
}

struct StillsCase {
    const char* name;
    std::string text;
};

const std::string kFiveKeys = "TransformTimes 0 .25 .5 .75 1\n";
const std::string kView = R"(
Film "image" "integer xresolution" 20 "integer yresolution" 20
Sampler "sobol" "integer pixelsamples" 16
Integrator "directlighting"
)";
const std::string kCamera = R"(
Camera "perspective" "float fov" 40
)";
const std::string kWorld = R"(
WorldBegin
LightSource "distant" "point3 from" [1 2 -3] "point3 to" [0 0 0] "rgb L" [2 2 2]
Material "matte" "rgb Kd" [.8 .8 .8]
)";
// An asymmetric tetrahedron.
const std::string kArm = R"(
Shape "trianglemesh" "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2]
  "point P" [-.2 -.2 -.2  1.6 .1 -.3  -.1 .5 .1  .3 .2 .7]
)";
const std::string kArmObject = "ObjectBegin \"arm\"" + kArm + "ObjectEnd\n";

/// A full turn over five keys, applied to `shape`.
std::string fullTurn(const std::string& shape) {
    return R"(
        ActiveTransform 1
        Rotate 90 0.2 0.1 1
        ActiveTransform 2
        Rotate 180 0.2 0.1 1
        ActiveTransform 3
        Rotate 270 0.2 0.1 1
        ActiveTransform 4
        Rotate 360 0.2 0.1 1
        ActiveTransform All
        )" +
           shape;
}

std::string rotatingInstance() {
    return kFiveKeys + kView + kCamera + kWorld + kArmObject + R"(
        AttributeBegin
          Translate -.4 0 5
        )" +
           fullTurn(R"(
          Scale .7 .7 .7
          ObjectInstance "arm"
        AttributeEnd
        Translate .6 .3 5
        Scale .5 1 .5
        ObjectInstance "arm"
        )");
}

std::string nestedMovingInstance() {
    return kFiveKeys + kView + kCamera + kWorld + kArmObject + R"(
        ObjectBegin "pair"
          ObjectInstance "arm"
          AttributeBegin
            Translate .5 .5 0
        )" +
           fullTurn(R"(
            ObjectInstance "arm"
          AttributeEnd
        ObjectEnd
        Translate 0 0 5
        )") +
           fullTurn(R"(
        Scale .8 .8 .8
        ObjectInstance "pair"
        )");
}

std::string deformingMesh() {
    return kView + kCamera + kWorld + R"(
        Translate 0 0 5
        Shape "trianglemesh" "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2] "integer keys" 3
          "point P" [-.2 -.2 -.2  1.6  .1 -.3  -.1  .5 .1  .3 .2 .7
                     -.8 -.2 -.2  1.2  .9 -.3  -.1  .5 .1  .3 .2 .7
                     -.2 -.9 -.2  1.6 1.1 -.3  -.1 1.5 .1  .3 .2 .7]
        )";
}

std::string movingCamera() {
    return kView + R"(
        Rotate -8 0 1 0
        Translate 0 0 5
        ActiveTransform EndTime
        Rotate 40 .3 1 .2
        Translate .3 0 0
        ActiveTransform All
        )" +
           kCamera + kWorld + kArm;
}

std::string pbrtV2Convention() {
    return R"(Option "string conventions" "pbrt-v2")" + kView + kCamera + kWorld + R"(
        Translate .3 0 5
        ActiveTransform EndTime
        Translate -.6 0 0
        Rotate 60 0 0 1
        Scale 1 1.8 1
        ActiveTransform All
        )" +
           kArm;
}

std::vector<StillsCase> stillsCases() {
    return {
        {"FullTurnOfFiveKeys", kFiveKeys + kView + kCamera + kWorld + "Translate 0 0 5\n" + fullTurn(kArm)},
        {"RotatingInstance", rotatingInstance()},
        {"NestedMovingInstance", nestedMovingInstance()},
        {"DeformingMesh", deformingMesh()},
        {"MovingCamera", movingCamera()},
        {"PbrtV2Convention", pbrtV2Convention()},
    };
}

class Stills : public testing::TestWithParam<StillsCase> {};

TEST_P(Stills, AverageOf256StillsEqualsTheMotionBlur) {
    constexpr int kStills = 256, kSeeds = 64;
    const std::string& text = GetParam().text;
    const test::PixelStatistics blurred = test::renderSeeds(test::build(text), kSeeds, 1000);
    // The stills form groups that each cover the shutter; the standard error is estimated between groups.
    std::vector<double> sum(blurred.mean.size()), sum2(sum.size());
    constexpr int kGroups = 16;
    for (int g = 0; g < kGroups; ++g) {
        std::vector<double> mean(sum.size());
        for (int i = g; i < kStills; i += kGroups) {
            BuildOptions options;
            const float time = (float(i) + .5f) / kStills;
            options.shutter = Shutter{time, time};
            const Image image = test::render(test::build(text, options), uint64_t(i)).image;
            for (size_t p = 0; p < mean.size(); ++p)
                mean[p] += double(image.pixels[p / 3][int(p % 3)]) * kGroups / kStills;
        }
        for (size_t p = 0; p < mean.size(); ++p) {
            sum[p] += mean[p];
            sum2[p] += mean[p] * mean[p];
        }
    }
    const double z = test::criticalZ(sum.size() / 3, kGroups);
    double largest = 0;
    for (size_t p = 0; p < sum.size(); p += 3) {
        const double stills = sum[p] / kGroups;
        const double error2 = std::max(0.0, sum2[p] / kGroups - stills * stills) / (kGroups - 1);
        const double error = std::sqrt(error2 + blurred.error[p] * blurred.error[p]);
        EXPECT_NEAR(stills, blurred.mean[p], z * error + 2e-3) << "pixel " << p / 3 % 20 << ',' << p / 60;
        largest = std::max(largest, stills);
    }
    EXPECT_GT(largest, 0.1) << "the object is visible";
}

INSTANTIATE_TEST_SUITE_P(Motion, Stills, testing::ValuesIn(stillsCases()),
                         [](const auto& info) { return info.param.name; });

TEST(Motion, NearlyEqualKeysAreStatic) {
    const auto scene = [](const std::string& motion) {
        return kView + kCamera + kWorld + R"(
            Translate 0 0 5
            ActiveTransform EndTime
            )" +
               motion +
               R"(
            ActiveTransform All
            )" +
               kArm;
    };
    const Image still = test::render(test::build(scene(""))).image;
    for (const char* motion : {"Translate 1e-7 0 0", "Rotate 1e-7 0 0 1", "Scale 1.0000001 1 1"}) {
        const BuiltScene built = test::build(scene(motion));
        EXPECT_EQ(built.scene->tracer().counts().timeSteps, 0u);
        const Image image = test::render(built).image;
        for (size_t p = 0; p < image.pixels.size(); ++p)
            EXPECT_NEAR(image.pixels[p].x, still.pixels[p].x, 1e-5f);
    }
}

} // namespace
} // namespace strobe
