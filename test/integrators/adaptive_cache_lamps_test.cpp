// adaptive-cache where it shares no light and the camera sees a lamp.
#include "integrators/sharing_support.h"
#include "support/fence_scene.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::haveEqualBits;
using test::render;
using test::renderInPasses;
using test::renderInSlices;

/// A small lamp that shines at the camera only.
const std::string kLamp = R"(
AttributeBegin
AreaLightSource "diffuse" "rgb L" [40 30 20]
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point3 P" [-1.71 -.24 4  -1.29 -.23 4  -1.27 .24 4  -1.73 .23 4]
AttributeEnd
)";

BuiltScene buildScene(int samples, const std::string& integrator = "adaptive-cache") {
    return test::buildWith(integrator, test::fenceScene(samples, 4, kLamp));
}

/// Returns the mean squared difference of the pixels in the columns x0 … x1 - 1.
double errorIn(const Image& image, const Image& reference, int x0, int x1) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = x0; x < x1; ++x)
            for (int c = 0; c < 3; ++c)
                sum += sqr(double(image.at(x, y)[c]) - double(reference.at(x, y)[c]));
    return sum / (3 * image.height * (x1 - x0));
}

TEST(AdaptiveCacheLamps, TheirEdgesHaveLessNoise) {
    constexpr int kWidth = 128;
    const Image reference = render(buildScene(4096, "supersample"), 99).image;
    const BuiltScene adaptive = buildScene(16), plain = buildScene(16, "supersample");
    double lamp = 0, plainLamp = 0, bars = 0, plainBars = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        const auto rendered = render(adaptive, seed);
        ASSERT_EQ(rendered.stats.integratorNote,
                  "shares no light, more camera rays at the edges of lamps, more samples where noise is");
        const Image own = render(plain, seed).image;
        lamp += errorIn(rendered.image, reference, 0, kWidth / 2);
        plainLamp += errorIn(own, reference, 0, kWidth / 2);
        bars += errorIn(rendered.image, reference, kWidth / 2, kWidth);
        plainBars += errorIn(own, reference, kWidth / 2, kWidth);
    }
    EXPECT_LT(lamp, 0.2 * plainLamp);
    EXPECT_LT(bars, 0.6 * plainBars) << "lamps do not hide other noise from the plan of the samples";
}

TEST(AdaptiveCacheLamps, ImagesDoNotDependOnThreadsAndTiles) {
    const BuiltScene built = buildScene(4);
    const Image image = render(built, 0, 1, 128).image;
    EXPECT_FALSE(haveEqualBits(image, render(buildScene(4, "supersample")).image));
    for (const auto& [threads, tile] : {std::pair(2, 16), {7, 5}, {3, 1}})
        EXPECT_TRUE(haveEqualBits(render(built, 0, threads, tile).image, image)) << threads << " " << tile;
}

TEST(AdaptiveCacheLamps, SlicesAddUpToTheWhole) {
    const BuiltScene built = buildScene(16);
    const Image whole = render(built).image;
    for (const std::vector<uint32_t>& ends : {std::vector<uint32_t>{16}, {1, 2, 5, 13, 16}})
        EXPECT_TRUE(haveEqualBits(renderInSlices(built, ends).image(), whole)) << ends.size();
}

TEST(AdaptiveCacheLamps, FilmsAreCompletedWithoutTheScene) {
    const BuiltScene built = buildScene(16);
    const Film film = renderInSlices(built, {3, 16});
    const test::MergedImages merged = test::mergeFilm(built, film);
    EXPECT_FALSE(haveEqualBits(merged.incomplete, film.image()));
    EXPECT_TRUE(haveEqualBits(merged.completed, film.image()));
}

TEST(AdaptiveCacheLamps, PassesDoNotDependOnTiles) {
    const BuiltScene built = buildScene(5);
    EXPECT_TRUE(haveEqualBits(renderInPasses(built, 3), renderInPasses(built, 3, 7)));
}

/// Components of the light are resolved from the same batches. They must not be recorded.
TEST(AdaptiveCacheLamps, ComponentsDoNotChangeTheImage) {
    const BuiltScene built = buildScene(4);
    const Image image = render(built).image;
    LightFilm lights(built.pixelBounds, {Aov::Direct, Aov::Indirect}, built.lightGroups);
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    RenderSettings settings;
    settings.samplesPerPixel = 4;
    settings.lights = &lights;
    strobe::render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                   settings, film);
    EXPECT_TRUE(haveEqualBits(film.image(), image));
}

/// The layers of sharing stay 0.
TEST(AdaptiveCacheLamps, NothingIsShared) {
    const BuiltScene built = buildScene(4);
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds, {Aov::SharedWeight});
    RenderSettings settings;
    settings.samplesPerPixel = 4;
    strobe::render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                   settings, film);
    for (const float weight : film.plane(Aov::SharedWeight))
        ASSERT_EQ(weight, 0);
}

} // namespace
} // namespace strobe
