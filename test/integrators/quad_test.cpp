// The integrator of docs/tutorial-integrator.md.
#include "integrators/quad.h"

#include "support/params.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// A floor that fills the image, lit by a near point light: radiance varies from pixel to pixel.
const std::string kFloor = R"(
Film "image" "integer xresolution" 16 "integer yresolution" 8
Sampler "sobol" "integer pixelsamples" 4
Integrator "directlighting"
LookAt 0 -4 3  0 0 0  0 0 1
Camera "perspective" "float fov" 40
WorldBegin
LightSource "point" "point3 from" [1 -1 1] "rgb I" [5 5 5]
Material "matte"
Shape "disk" "float radius" 100
)";

BuiltScene buildFloor(int size = 2, const std::string& text = kFloor) {
    BuiltScene built = test::build(text);
    Diagnostics quiet;
    built.integrator =
        quadPlugin().create(test::Params().ints("size", {size}), BuildContext{quiet, Conventions::PbrtV4});
    return built;
}

TEST(Quad, ShadesOncePerSquare) {
    const test::Rendered rendered = test::render(buildFloor());
    EXPECT_EQ(rendered.stats.total.visibilitySamples, 16u * 8 * 4);
    EXPECT_EQ(rendered.stats.total.shades, 8u * 4);
    const Image& image = rendered.image;
    for (int y = 0; y < 8; y += 2)
        for (int x = 0; x < 16; x += 2) {
            EXPECT_EQ(image.at(x, y), image.at(x + 1, y + 1));
            EXPECT_NE(image.at(x, y), image.at((x + 2) % 16, y)) << "squares do not share";
        }
}

TEST(Quad, TheMeanOverSeedsIsWithinTheBiasBound) {
    constexpr int kSeeds = 64;
    const auto exact = test::renderSeeds(test::build(kFloor), kSeeds, 100);
    const auto shared = test::renderSeeds(buildFloor(), kSeeds, 900);
    const int reach =
        int(std::ceil(buildFloor().integrator->biasBound(*test::build(kFloor).scene).reachPixels));
    const double z = test::criticalZ(exact.mean.size(), kSeeds);
    for (int y = reach; y < 8 - reach; ++y)
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
        const BuiltScene built = buildFloor(3, text);
        return built.integrator->biasBound(*built.scene);
    };
    EXPECT_FLOAT_EQ(boundOf(kFloor).reachPixels, 3 * std::sqrt(2.f));
    EXPECT_EQ(boundOf(kFloor).shutterFraction, 0);
    const BiasBound moving =
        boundOf(kFloor + R"(ActiveTransform EndTime Translate 0 0 1 Shape "sphere" "float radius" .1)");
    EXPECT_EQ(moving.reachPixels, kInfinity);
    EXPECT_EQ(moving.shutterFraction, 1);
}

TEST(Quad, ASizeBelowOneIsAnError) {
    try {
        buildFloor(0);
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "\"size\" must be at least 1");
    }
}

} // namespace
} // namespace strobe
