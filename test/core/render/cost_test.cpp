// A scene pays only for what it uses: counters of rays, shades, footprints and time steps.
#include "support/render_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

std::string head(const std::string& shading) {
    return R"(
        Film "image" "integer xresolution" 20 "integer yresolution" 12
        Sampler "sobol" "integer pixelsamples" 16
        )" +
           shading + R"(
        Camera "perspective" "float fov" 60
        WorldBegin
        )";
}
const std::string kDirect = R"(Integrator "directlighting")";
const std::string kPath = R"(Integrator "path")";
const std::string kPoint = R"(
    LightSource "point" "point from" [1 2 0]
)";
const std::string kBall = R"(
    AttributeBegin
      Translate 0 0 4
      Shape "sphere"
    AttributeEnd
)";
const std::string kWall = R"(
    AttributeBegin
      Translate 0 0 6
      Shape "trianglemesh" "integer indices" [0 1 2 0 2 3]
        "point P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0] "point2 uv" [0 0  1 0  1 1  0 1]
    AttributeEnd
)";
constexpr uint64_t kPixels = 20 * 12, kSamples = kPixels * 16;

Counters countersOf(const std::string& text, const BuildOptions& options = {}) {
    return test::render(test::build(text, options)).stats.total;
}

std::string lamp(double radius, int samples = 1) {
    return fmt::format(R"(
        AttributeBegin
          Translate 3 4 1
          AreaLightSource "diffuse" "rgb L" [9 9 9] "integer nsamples" {}
          Shape "sphere" "float radius" {}
        AttributeEnd
        )",
                       samples, radius);
}

TEST(Cost, CameraRaysAndShadesEqualPixelsTimesSamples) {
    const Counters c = countersOf(head(kDirect) + kPoint + kBall);
    EXPECT_EQ(c.pixels, kPixels);
    EXPECT_EQ(c.visibilitySamples, kSamples);
    EXPECT_GT(c.missed, 0u);
    EXPECT_EQ(c.shades + c.missed, kSamples);
    EXPECT_EQ(c.surfaces, c.shades);
    // A point light needs at most one shadow ray per surface point, and no other rays.
    EXPECT_GT(c.shadowRays, 0u);
    EXPECT_LE(c.shadowRays, c.surfaces);
    EXPECT_EQ(c.lightRays + c.bounceRays, 0u);
    EXPECT_EQ(c.rays(), c.visibilitySamples + c.shadowRays);
    EXPECT_EQ(c.invalidSamples, 0u);

    BuildOptions options;
    options.crop = {0, .5f, 0, 1};
    options.samplesPerPixel = 4;
    const Counters crop = countersOf(head(kDirect) + kPoint + kBall, options);
    EXPECT_EQ(crop.pixels, kPixels / 2);
    EXPECT_EQ(crop.visibilitySamples, kPixels / 2 * 4);
}

TEST(Cost, CountersOfThreadsAddUp) {
    const BuiltScene built = test::build(head(kPath) + lamp(2) + kBall + kWall);
    const Counters one = test::render(built, 0, 1).stats.total;
    const test::Rendered many = test::render(built, 0, 5, 2);
    Counters sum;
    for (const Counters& thread : many.stats.threads)
        sum.add(thread);
    const auto all = [](const Counters& c) {
        return std::vector<uint64_t>{c.pixels,     c.visibilitySamples, c.shades,      c.missed,
                                     c.shadowRays, c.lightRays,         c.bounceRays,  c.surfaces,
                                     c.footprints, c.invalidSamples,    c.lightSamples};
    };
    EXPECT_EQ(all(sum), all(many.stats.total));
    EXPECT_EQ(all(one), all(many.stats.total)) << "the work does not depend on the threads";
}

TEST(Cost, LightsTakeTheirNumberOfSamples) {
    // The lamp is visible from every point of the wall.
    const Counters one = countersOf(head(kDirect) + lamp(.1) + kWall);
    const Counters eight = countersOf(head(kDirect) + lamp(.1, 8) + kWall);
    EXPECT_EQ(one.shadowRays, one.surfaces);
    EXPECT_EQ(eight.shadowRays, 8 * eight.surfaces);
    EXPECT_EQ(one.lightSamples, one.surfaces);
    EXPECT_EQ(eight.lightSamples, 8 * eight.surfaces);
    const Counters picked =
        countersOf(head(kDirect + R"( "string strategy" "one")") + lamp(.1, 8) + kPoint + kWall);
    EXPECT_LE(picked.shadowRays, picked.surfaces);
    EXPECT_EQ(picked.lightSamples, picked.surfaces);
    const Counters unlit =
        countersOf(head(kDirect) + "LightSource \"point\" \"point from\" [1 2 9]\n" + kWall);
    EXPECT_EQ(unlit.lightSamples, unlit.surfaces);
    EXPECT_EQ(unlit.shadowRays, 0u);
}

TEST(Cost, SmallLightsAreNotSampledByTheBsdf) {
    const std::string matte = R"(Material "matte")";
    const std::string glossy = R"(Material "plastic" "float roughness" .0001)";
    EXPECT_EQ(countersOf(head(kDirect) + lamp(.1, 4) + matte + kWall).lightRays, 0u);
    EXPECT_GT(countersOf(head(kDirect) + lamp(2, 4) + matte + kWall).lightRays, 0u);
    const Counters gloss = countersOf(head(kDirect) + lamp(.5, 4) + glossy + kWall);
    EXPECT_GT(gloss.lightRays, 0u);
    // Only rays that may hit the lamp are traced: far fewer than there are BSDF samples.
    EXPECT_LT(gloss.lightRays, gloss.surfaces);
}

TEST(Cost, BounceRaysDependOnTheShading) {
    EXPECT_EQ(countersOf(head(kDirect) + lamp(.1) + kBall + kWall).bounceRays, 0u);
    EXPECT_GT(countersOf(head(kPath) + lamp(.1) + kBall + kWall).bounceRays, 0u);
    EXPECT_EQ(countersOf(head(kPath + R"( "integer maxdepth" 0)") + lamp(.1) + kBall + kWall).rays(),
              kSamples);
    // A mirror opposite to a wall: one specular ray per sample, direct light at the second surface only.
    const Counters mirror = countersOf(head(kDirect) + kPoint + R"(
        AttributeBegin
          Material "mirror"
        )" + kWall + R"(
        AttributeEnd
        Translate 0 0 -12
        Scale 3 3 1
        )" + kWall);
    EXPECT_EQ(mirror.bounceRays, kSamples);
    EXPECT_EQ(mirror.surfaces, 2 * kSamples);
}

TEST(Cost, FootprintsAreComputedForTexturedMaterialsOnly) {
    const std::string textures = R"(
        Texture "checks" "rgb" "checkerboard" "rgb tex1" [.2 .2 .2] "rgb tex2" [.9 .9 .9]
        Texture "constant" "rgb" "constant" "rgb value" [.2 .2 .2]
        )";
    const std::string useChecks = R"(Material "matte" "texture Kd" "checks")";
    const std::string useConstant = R"(Material "matte" "texture Kd" "constant")";
    for (const std::string& shading : {kDirect, kPath}) {
        const std::string start = head(shading) + lamp(2) + textures;
        const BuiltScene unused = test::build(start + kBall + kWall);
        EXPECT_FALSE(unused.scene->needsFootprint());
        EXPECT_EQ(test::render(unused).stats.total.footprints, 0u);
        EXPECT_EQ(countersOf(start + useConstant + kBall + kWall).footprints, 0u);

        const Counters both = countersOf(start + useChecks + kBall + kWall);
        EXPECT_GT(both.footprints, 0u);
        EXPECT_LE(both.footprints, both.surfaces);
        const Counters ballOnly =
            countersOf(start + "AttributeBegin\n" + useChecks + kBall + "AttributeEnd\n" + kWall);
        EXPECT_GT(ballOnly.footprints, 0u);
        EXPECT_LT(ballOnly.footprints, both.footprints);
    }
}

TEST(Cost, OnlyMovingGeometryHasTimeSteps) {
    const std::string motion = R"(
        ActiveTransform EndTime
        Translate .1 0 0
        ActiveTransform All
        )";
    const auto counts = [](const std::string& text) { return test::build(text).scene->tracer().counts(); };
    const TracerCounts still = counts(head(kDirect) + kPoint + kWall + kBall);
    EXPECT_EQ(still.timeSteps, 0u);
    EXPECT_EQ(still.instances, 0u);
    const TracerCounts moving = counts(head(kDirect) + kPoint + kWall + kWall + "AttributeBegin\n" + motion +
                                       kBall + "AttributeEnd\n");
    EXPECT_EQ(moving.timeSteps, 2u);
    EXPECT_EQ(moving.triangles, 4u);
    // An instantaneous shutter and keys outside of the shutter make everything static.
    const std::string world = "WorldBegin\n" + kPoint + motion + kBall + kWall;
    const std::string instant = R"(Camera "perspective" "float shutteropen" .5 "float shutterclose" .5
        )";
    const std::string camera = R"(Camera "perspective"
        )";
    EXPECT_EQ(counts(instant + world).timeSteps, 0u);
    EXPECT_EQ(counts("TransformTimes -2 -1\n" + camera + world).timeSteps, 0u);
    EXPECT_EQ(counts(camera + world).timeSteps, 4u);
}

TEST(Cost, MovingGeometryCostsNothingElsewhere) {
    // Neither the moving ball nor its shadow is in the left half of the image.
    const std::string start = head(kDirect) + R"(
        LightSource "point" "point from" [0 0 0]
        )" + kWall;
    const std::string ball = R"(
        ActiveTransform EndTime
        Translate .2 0 0
        ActiveTransform All
        Translate 1.5 0 4
        Shape "sphere" "float radius" .2
        )";
    BuildOptions left;
    left.crop = {0, .5f, 0, 1};
    const test::Rendered without = test::render(test::build(start, left));
    const test::Rendered with = test::render(test::build(start + ball, left));
    EXPECT_EQ(with.stats.total.rays(), without.stats.total.rays());
    EXPECT_EQ(with.stats.total.surfaces, without.stats.total.surfaces);
    EXPECT_EQ(0, std::memcmp(with.image.pixels.data(), without.image.pixels.data(),
                             with.image.pixels.size() * sizeof(Rgb)));
}

} // namespace
} // namespace strobe
