// Alpha cut-outs: the expected coverage of a surface is its alpha, for camera rays and shadow rays.
#include "support/render_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace strobe {
namespace {

const std::string kHead = R"(
    Film "image" "integer xresolution" 4 "integer yresolution" 4
    Sampler "independent" "integer pixelsamples" 256
    Integrator "directlighting"
    Camera "orthographic" "float screenwindow" [-1 1 -1 1]
    WorldBegin
)";

std::string sheet(double alpha) {
    return fmt::format(R"(
        Shape "trianglemesh" "float alpha" {}
          "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]
        )",
                       alpha);
}

TEST(Alpha, CoverageOfASheetIsItsAlpha) {
    // A black sheet in front of a white background: the background contributes 1 - alpha.
    for (double alpha : {0.0, 0.3, 1.0}) {
        const std::string world = R"(
            LightSource "infinite" "rgb L" [1 1 1]
            Material "matte" "rgb Kd" [0 0 0]
            Translate 0 0 3
            )";
        const BuiltScene built = test::build(kHead + world + sheet(alpha));
        EXPECT_EQ(built.scene->tracer().counts().filteredGeometries, alpha < 1 ? 1u : 0u);
        const test::PixelStatistics s = test::renderSeeds(built, 16);
        for (int i = 0; i < 16; ++i)
            EXPECT_NEAR(s.meanOf(i % 4, i / 4), 1 - alpha,
                        test::criticalZ(16, 16) * s.errorOf(i % 4, i / 4) + 1e-6);
    }
}

TEST(Alpha, ShadowOfASheetHasItsAlpha) {
    const std::string light = R"(
        LightSource "distant" "point from" [1 0 -1] "point to" [0 0 0]
        Material "matte" "rgb Kd" [1 1 1]
        )";
    const std::string wall = "Translate 0 0 9" + sheet(1);
    const std::string occluder = R"(
        AttributeBegin
          Translate 8 0 6
          Scale .7 .7 .7
        )" + sheet(.4) + "AttributeEnd\n";
    const test::PixelStatistics lit = test::renderSeeds(test::build(kHead + light + wall), 2);
    const test::PixelStatistics shadowed =
        test::renderSeeds(test::build(kHead + light + occluder + wall), 16);
    for (int i = 0; i < 16; ++i)
        EXPECT_NEAR(shadowed.meanOf(i % 4, i / 4), 0.6 * lit.meanOf(i % 4, i / 4),
                    test::criticalZ(16, 16) * shadowed.errorOf(i % 4, i / 4) + 1e-6);
}

} // namespace
} // namespace strobe
