// The integrator of docs/tutorial-integrator.md.
#include "integrators/quad.h"

#include "support/params.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// A wall that fills the image, lit from a corner: radiance varies from pixel to pixel.
const std::string kWall = R"(
Film "image" "integer xresolution" 16 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 4
Integrator "directlighting"
LookAt 0 0 4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
LightSource "point" "point3 from" [3 3 1] "rgb I" [50 50 50]
Material "matte"
Shape "disk" "float radius" 100
)";

BuiltScene buildWall(int size = 2, const std::string& text = kWall) {
    BuiltScene built = test::build(text);
    Diagnostics quiet;
    built.integrator =
        quadPlugin().create(test::Params().ints("size", {size}), BuildContext{quiet, Conventions::PbrtV4});
    return built;
}

TEST(Quad, ShadesOncePerSquare) {
    const test::Rendered rendered = test::render(buildWall());
    EXPECT_EQ(rendered.stats.total.visibilitySamples, 16u * 16 * 4);
    EXPECT_EQ(rendered.stats.total.shades, 8u * 8);
    const Image& image = rendered.image;
    for (int y = 0; y < 16; y += 2)
        for (int x = 0; x < 16; x += 2) {
            EXPECT_EQ(image.at(x, y), image.at(x + 1, y + 1));
            EXPECT_NE(image.at(x, y), image.at((x + 2) % 16, y)) << "squares do not share";
        }
}

TEST(Quad, TheMeanOverSeedsIsWithinTheBiasBound) {
    constexpr int kSeeds = 64;
    const auto exact = test::renderSeeds(test::build(kWall), kSeeds, 100);
    const auto shared = test::renderSeeds(buildWall(), kSeeds, 900);
    const int reach =
        int(std::ceil(buildWall().integrator->biasBound(*test::build(kWall).scene).reachPixels));
    const double z = test::criticalZ(exact.mean.size(), kSeeds);
    for (int y = reach; y < 16 - reach; ++y)
        for (int x = reach; x < 16 - reach; ++x) {
            double low = exact.meanOf(x, y), high = low;
            for (int v = y - reach; v <= y + reach; ++v)
                for (int u = x - reach; u <= x + reach; ++u) {
                    low = std::min(low, exact.meanOf(u, v));
                    high = std::max(high, exact.meanOf(u, v));
                }
            const double noise = z * std::hypot(exact.errorOf(x, y), shared.errorOf(x, y));
            EXPECT_GT(shared.meanOf(x, y), low - noise);
            EXPECT_LT(shared.meanOf(x, y), high + noise);
        }
}

TEST(Quad, TheBiasIsUnboundedWhereAnythingMoves) {
    const auto boundOf = [](const std::string& text) {
        const BuiltScene built = buildWall(3, text);
        return built.integrator->biasBound(*built.scene);
    };
    EXPECT_FLOAT_EQ(boundOf(kWall).reachPixels, 3 * std::sqrt(2.f));
    EXPECT_EQ(boundOf(kWall).shutterFraction, 0);
    const BiasBound moving =
        boundOf(kWall + R"(ActiveTransform EndTime Translate 0 0 1 Shape "sphere" "float radius" .1)");
    EXPECT_EQ(moving.reachPixels, kInfinity);
    EXPECT_EQ(moving.shutterFraction, 1);
}

TEST(Quad, ASizeBelowOneIsAnError) {
    try {
        buildWall(0);
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "\"size\" must be at least 1");
    }
}

} // namespace
} // namespace strobe
