// Cut-outs: a surface covers what its alpha says, for camera rays and for shadows.
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

const std::string kHead =
    "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n"
    "Sampler \"independent\" \"integer pixelsamples\" 256\nIntegrator \"directlighting\"\n"
    "Camera \"orthographic\" \"float screenwindow\" [-1 1 -1 1]\nWorldBegin\n";
const std::string kQuad = "\"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 -9 0 9 -9 0 9 9 0 -9 9 0]\n";

TEST(Alpha, CoversWhatItSays) {
    // A black sheet before a white world: what is left is 1 - alpha.
    for (double alpha : {0.0, 0.3, 1.0}) {
        const BuiltScene built =
            test::build(kHead +
                        "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [0 0 "
                        "0]\nTranslate 0 0 3\n" +
                        "Shape \"trianglemesh\" \"float alpha\" " + std::to_string(alpha) + " " + kQuad);
        EXPECT_EQ(built.scene->tracer().counts().filteredGeometries, alpha < 1 ? 1u : 0u);
        const test::PixelStatistics s = test::renderSeeds(built, 16);
        for (int i = 0; i < 16; ++i)
            EXPECT_NEAR(s.meanOf(i % 4, i / 4), 1 - alpha,
                        test::criticalZ(16, 16) * s.errorOf(i % 4, i / 4) + 1e-6);
    }
}

TEST(Alpha, ShadowsLetThrough) {
    const auto scene = [](const std::string& sheet) {
        return kHead +
               "LightSource \"distant\" \"point from\" [1 0 -1] \"point to\" [0 0 0]\nMaterial \"matte\" "
               "\"rgb Kd\" [1 1 1]\n" +
               sheet + "Translate 0 0 9\nShape \"trianglemesh\" " + kQuad;
    };
    const std::string sheet =
        "AttributeBegin\nTranslate 8 0 6\nScale .7 .7 .7\nShape \"trianglemesh\" \"float alpha\" .4 " +
        kQuad + "AttributeEnd\n";
    const test::PixelStatistics bare = test::renderSeeds(test::build(scene("")), 2);
    const test::PixelStatistics shaded = test::renderSeeds(test::build(scene(sheet)), 16);
    for (int i = 0; i < 16; ++i)
        EXPECT_NEAR(shaded.meanOf(i % 4, i / 4), 0.6 * bare.meanOf(i % 4, i / 4),
                    test::criticalZ(16, 16) * shaded.errorOf(i % 4, i / 4) + 1e-6);
}

} // namespace
} // namespace strobe
