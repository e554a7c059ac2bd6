// Motion blur against closed forms and against averages of stills.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

TEST(Motion, EdgeCoverageIsTheTrapezoid) {
    // One world unit is one pixel; a bar of 6 pixels travels 10.
    const double a = -9.3, b = -3.3, v = 10;
    const std::string text =
        "Film \"image\" \"integer xresolution\" 32 \"integer yresolution\" 2\n"
        "Sampler \"independent\" \"integer pixelsamples\" 256\nIntegrator \"directlighting\"\n"
        "Camera \"orthographic\" \"float screenwindow\" [-16 16 -1 1]\nWorldBegin\n"
        "Material \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool "
        "twosided\" true\n"
        "Translate 0 0 5\nActiveTransform EndTime\nTranslate 10 0 0\nActiveTransform All\n"
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" "
        "[-9.3 -5 0  -3.3 -5 0  -3.3 5 0  -9.3 5 0]\n";
    const test::PixelStatistics s = test::renderSeeds(test::build(text), 32);
    const double z = test::criticalZ(64, 32);
    for (int x = 0; x < 32; ++x) {
        double coverage = 0;
        constexpr int kSteps = 20000;
        for (int i = 0; i < kSteps; ++i) {
            const double shift = v * (i + .5) / kSteps + 16;
            coverage += std::max(0.0, std::min(x + 1.0, b + shift) - std::max(double(x), a + shift));
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

const std::string kView = "Film \"image\" \"integer xresolution\" 20 \"integer yresolution\" 20\n"
                          "Sampler \"sobol\" \"integer pixelsamples\" 16\nIntegrator \"directlighting\"\n";
const std::string kLit =
    "LightSource \"distant\" \"point3 from\" [1 2 -3] \"point3 to\" [0 0 0] \"rgb L\" [2 2 2]\n"
    "Material \"matte\" \"rgb Kd\" [.8 .8 .8]\n";
// A lopsided tetrahedron-like arm: nothing about it is symmetric.
const std::string kArm = "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 1 3 1 2 3 0 3 2] \"point P\" "
                         "[-.2 -.2 -.2  1.6 .1 -.3  -.1 .5 .1  .3 .2 .7]\n";

std::string fullTurn(const std::string& shape) {
    std::string keys;
    for (int i = 1; i < 5; ++i)
        keys +=
            "ActiveTransform " + std::to_string(i) + "\nRotate " + std::to_string(90 * i) + " 0.2 0.1 1\n";
    return keys + "ActiveTransform All\n" + shape;
}

std::vector<StillsCase> stillsCases() {
    const std::string camera = "Camera \"perspective\" \"float fov\" 40\n";
    const std::string five = "TransformTimes 0 .25 .5 .75 1\n";
    return {
        {"FullTurnOfFiveKeys",
         five + kView + camera + "WorldBegin\n" + kLit + "Translate 0 0 5\n" + fullTurn(kArm)},
        {"RotatingInstance", five + kView + camera + "WorldBegin\n" + kLit + "ObjectBegin \"arm\"\n" + kArm +
                                 "ObjectEnd\nAttributeBegin\nTranslate -.4 0 5\n" +
                                 fullTurn("Scale .7 .7 .7\nObjectInstance \"arm\"\n") +
                                 "AttributeEnd\nTranslate .6 .3 5\nScale .5 1 .5\nObjectInstance \"arm\"\n"},
        {"NestedMovingInstance",
         five + kView + camera + "WorldBegin\n" + kLit + "ObjectBegin \"arm\"\n" + kArm +
             "ObjectEnd\nObjectBegin \"pair\"\nObjectInstance \"arm\"\nAttributeBegin\nTranslate .5 .5 0\n" +
             fullTurn("ObjectInstance \"arm\"\n") + "AttributeEnd\nObjectEnd\nTranslate 0 0 5\n" +
             fullTurn("Scale .8 .8 .8\nObjectInstance \"pair\"\n")},
        {"DeformingMesh", kView + camera + "WorldBegin\n" + kLit +
                              "Translate 0 0 5\nShape \"trianglemesh\" \"integer indices\" [0 2 1 0 1 3 1 2 "
                              "3 0 3 2] \"integer keys\" 3 "
                              "\"point P\" [-.2 -.2 -.2  1.6 .1 -.3  -.1 .5 .1  .3 .2 .7   -.8 -.2 -.2  1.2 "
                              ".9 -.3  -.1 .5 .1  .3 .2 .7 "
                              "  -.2 -.9 -.2  1.6 1.1 -.3  -.1 1.5 .1  .3 .2 .7]\n"},
        {"MovingCamera",
         kView + "Rotate -8 0 1 0\nTranslate 0 0 5\nActiveTransform EndTime\nRotate 40 .3 1 .2\n" +
             "Translate .3 0 0\nActiveTransform All\n" + camera + "WorldBegin\n" + kLit + kArm},
        {"PbrtV2Convention",
         "Option \"string conventions\" \"pbrt-v2\"\n" + kView + camera + "WorldBegin\n" + kLit +
             "Translate .3 0 5\nActiveTransform EndTime\nTranslate -.6 0 0\nRotate 60 0 0 1\nScale 1 1.8 1\n"
             "ActiveTransform All\n" +
             kArm},
    };
}

class Stills : public testing::TestWithParam<StillsCase> {};

TEST_P(Stills, AverageOf256EqualsTheBlur) {
    constexpr int kStills = 256, kSeeds = 32;
    const std::string& text = GetParam().text;
    const test::PixelStatistics blurred = test::renderSeeds(test::build(text), kSeeds, 1000);
    // Stills in kSeeds groups that each spread over the shutter: the spread between groups is their error.
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
        for (size_t p = 0; p < mean.size(); ++p)
            sum[p] += mean[p], sum2[p] += mean[p] * mean[p];
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
    EXPECT_GT(largest, 0.1); // something was seen
}

INSTANTIATE_TEST_SUITE_P(Motion, Stills, testing::ValuesIn(stillsCases()),
                         [](const auto& info) { return info.param.name; });

TEST(Motion, KeysThatHardlyDifferRenderAsStill) {
    const auto scene = [](const std::string& motion) {
        return kView + "Camera \"perspective\" \"float fov\" 40\nWorldBegin\n" + kLit +
               "Translate 0 0 5\nActiveTransform EndTime\n" + motion + "ActiveTransform All\n" + kArm;
    };
    const Image still = test::render(test::build(scene(""))).image;
    for (const char* motion : {"Translate 1e-7 0 0\n", "Rotate 1e-7 0 0 1\n", "Scale 1.0000001 1 1\n"}) {
        const BuiltScene built = test::build(scene(motion));
        EXPECT_EQ(built.scene->tracer().counts().timeSteps, 0u);
        const Image image = test::render(built).image;
        for (size_t p = 0; p < image.pixels.size(); ++p)
            EXPECT_NEAR(image.pixels[p].x, still.pixels[p].x, 1e-5f);
    }
}

} // namespace
} // namespace strobe
