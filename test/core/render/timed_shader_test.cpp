// The measured cost of a shade.
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

TEST(ShadeCost, EstimatesMeanAndDeviation) {
    // Packets of 1 and 4 shades whose costs are 1 or 3: the deviation is that of a shade, not of a packet.
    ShadeCost cost;
    uint32_t state = 1;
    const auto randomCost = [&] {
        state = state * 1664525u + 1013904223u;
        return state >> 31 ? 3.0 : 1.0;
    };
    for (int i = 0; i < 4000; ++i) {
        const int n = i % 2 ? 4 : 1;
        double seconds = 0;
        for (int k = 0; k < n; ++k)
            seconds += randomCost();
        cost.add(uint64_t(n), seconds);
    }
    EXPECT_EQ(cost.shades(), 10000u);
    EXPECT_NEAR(cost.mean(), 2, 0.05);
    EXPECT_NEAR(cost.deviation(), 1, 0.05);
}

TEST(ShadeCost, IsMeasuredPerMaterial) {
    const std::string text = R"(
        Film "image" "integer xresolution" 16 "integer yresolution" 8
        Sampler "sobol" "integer pixelsamples" 16
        Integrator "directlighting"
        Camera "orthographic" "float screenwindow" [-2 2 -1 1]
        WorldBegin
        LightSource "infinite"
        Material "matte"
        Shape "trianglemesh" "integer indices" [0 1 2] "point P" [0 -9 5  0 9 5  -99 0 5]
        )";
    const auto rendered = test::render(test::build(text), 0, 1, 8); // several batches
    const auto& costs = rendered.stats.total.shadeCosts;
    ASSERT_GE(costs.size(), 2u);
    uint64_t shades = 0;
    for (const ShadeCost& cost : costs)
        shades += cost.shades();
    EXPECT_GT(shades, 0u);
    EXPECT_LE(shades, rendered.stats.total.shades + rendered.stats.total.missed);
}

} // namespace
} // namespace strobe
