// A scene pays for what it uses: counters of rays, shades, footprints and time steps.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

std::string head(const std::string& shading, const std::string& more = "") {
    return "Film \"image\" \"integer xresolution\" 20 \"integer yresolution\" 12\n"
           "Sampler \"sobol\" \"integer pixelsamples\" 16\n" +
           shading + '\n' + more + "Camera \"perspective\" \"float fov\" 60\nWorldBegin\n";
}
const std::string kDirect = "Integrator \"directlighting\"";
const std::string kPoint = "LightSource \"point\" \"point from\" [1 2 0]\n";
const std::string kBall = "AttributeBegin\nTranslate 0 0 4\nShape \"sphere\"\nAttributeEnd\n";
const std::string kWall =
    "AttributeBegin\nTranslate 0 0 6\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] "
    "\"point P\" [-9 -9 0 9 -9 0 9 9 0 -9 9 0] \"point2 uv\" [0 0 1 0 1 1 0 1]\nAttributeEnd\n";
constexpr uint64_t kPixels = 20 * 12, kSamples = kPixels * 16;

Counters countersOf(const std::string& text, const BuildOptions& options = {}) {
    return test::render(test::build(text, options)).stats.total;
}

std::string lamp(double radius, int samples = 1) {
    return "AttributeBegin\nTranslate 3 4 1\nAreaLightSource \"diffuse\" \"rgb L\" [9 9 9] \"integer "
           "nsamples\" " +
           std::to_string(samples) + "\nShape \"sphere\" \"float radius\" " + std::to_string(radius) +
           "\nAttributeEnd\n";
}

TEST(Cost, CameraRaysArePixelsTimesSamples) {
    const Counters c = countersOf(head(kDirect) + kPoint + kBall);
    EXPECT_EQ(c.pixels, kPixels);
    EXPECT_EQ(c.visibilitySamples, kSamples);
    EXPECT_GT(c.missed, 0u);
    EXPECT_EQ(c.shades + c.missed, kSamples);
    EXPECT_EQ(c.surfaces, c.shades);
    // A point light: at most one shadow ray for each lit surface, and no other.
    EXPECT_GT(c.shadowRays, 0u);
    EXPECT_LE(c.shadowRays, c.surfaces);
    EXPECT_EQ(c.lightRays + c.bounceRays, 0u);
    EXPECT_EQ(c.rays(), c.visibilitySamples + c.shadowRays);
    EXPECT_EQ(c.invalidSamples, 0u);

    BuildOptions options;
    options.crop = {0, .5f, 0, 1};
    options.samplesPerPixel = 4;
    const Counters part = countersOf(head(kDirect) + kPoint + kBall, options);
    EXPECT_EQ(part.pixels, kPixels / 2);
    EXPECT_EQ(part.visibilitySamples, kPixels / 2 * 4);
}

TEST(Cost, ThreadsAddUp) {
    const BuiltScene built = test::build(head("Integrator \"path\"") + lamp(2) + kBall + kWall);
    const Counters one = test::render(built, 0, 1).stats.total;
    const test::Rendered many = test::render(built, 0, 5, 2);
    Counters sum;
    for (const Counters& thread : many.stats.threads)
        sum.add(thread);
    const auto all = [](const Counters& c) {
        return std::vector<uint64_t>{c.pixels,     c.visibilitySamples, c.shades,     c.missed,
                                     c.shadowRays, c.lightRays,         c.bounceRays, c.surfaces,
                                     c.footprints, c.invalidSamples};
    };
    EXPECT_EQ(all(sum), all(many.stats.total));
    EXPECT_EQ(all(one), all(many.stats.total)); // the work does not depend on who does it
}

TEST(Cost, AllLightsTakeTheirSamples) {
    // Nothing is between the wall and the lamp, and the lamp is above the horizon of every point of the wall.
    const Counters one = countersOf(head(kDirect) + lamp(.1) + kWall);
    const Counters eight = countersOf(head(kDirect) + lamp(.1, 8) + kWall);
    EXPECT_EQ(one.shadowRays, one.surfaces);
    EXPECT_EQ(eight.shadowRays, 8 * eight.surfaces);
    const Counters picked = countersOf(head("Integrator \"directlighting\" \"string strategy\" \"one\"") +
                                       lamp(.1, 8) + kPoint + kWall);
    EXPECT_LE(picked.shadowRays, picked.surfaces);
}

TEST(Cost, SmallLightsAreNotSoughtByTheBsdf) {
    const std::string dull = "Material \"matte\"\n";
    const std::string glossy = "Material \"plastic\" \"float roughness\" .0001\n";
    EXPECT_EQ(countersOf(head(kDirect) + lamp(.1, 4) + dull + kWall).lightRays, 0u);
    EXPECT_GT(countersOf(head(kDirect) + lamp(2, 4) + dull + kWall).lightRays, 0u);
    const Counters gloss = countersOf(head(kDirect) + lamp(.5, 4) + glossy + kWall);
    EXPECT_GT(gloss.lightRays, 0u);
    // Only rays that may meet the lamp are traced: far fewer than were drawn.
    EXPECT_LT(gloss.lightRays, gloss.surfaces);
}

TEST(Cost, BouncesFollowTheShading) {
    EXPECT_EQ(countersOf(head(kDirect) + lamp(.1) + kBall + kWall).bounceRays, 0u);
    EXPECT_GT(countersOf(head("Integrator \"path\"") + lamp(.1) + kBall + kWall).bounceRays, 0u);
    EXPECT_EQ(
        countersOf(head("Integrator \"path\" \"integer maxdepth\" 0") + lamp(.1) + kBall + kWall).rays(),
        kSamples);
    // A mirror before a wall: one specular ray a sample, and light at the second surface alone.
    const Counters mirror = countersOf(head(kDirect) + kPoint + "AttributeBegin\nMaterial \"mirror\"\n" +
                                       kWall + "AttributeEnd\nTranslate 0 0 -12\nScale 3 3 1\n" + kWall);
    EXPECT_EQ(mirror.bounceRays, kSamples);
    EXPECT_EQ(mirror.surfaces, 2 * kSamples);
}

TEST(Cost, FootprintsForTexturesAlone) {
    const std::string checks =
        "Texture \"c\" \"rgb\" \"checkerboard\" \"rgb tex1\" [.2 .2 .2] \"rgb tex2\" [.9 .9 .9]\n";
    const std::string constant = "Texture \"k\" \"rgb\" \"constant\" \"rgb value\" [.2 .2 .2]\n";
    const std::string use = "Material \"matte\" \"texture Kd\" ";
    for (const char* shading : {"Integrator \"directlighting\"", "Integrator \"path\""}) {
        const std::string start = head(shading) + lamp(2) + checks + constant; // declared is not used
        const BuiltScene plain = test::build(start + kBall + kWall);
        EXPECT_FALSE(plain.scene->needsFootprint());
        EXPECT_EQ(test::render(plain).stats.total.footprints, 0u);
        EXPECT_EQ(countersOf(start + use + "\"k\"\n" + kBall + kWall).footprints, 0u);

        const Counters all = countersOf(start + use + "\"c\"\n" + kBall + kWall);
        EXPECT_GT(all.footprints, 0u);
        EXPECT_LE(all.footprints, all.surfaces);
        const Counters ball =
            countersOf(start + "AttributeBegin\n" + use + "\"c\"\n" + kBall + "AttributeEnd\n" + kWall);
        EXPECT_GT(ball.footprints, 0u);
        EXPECT_LT(ball.footprints, all.footprints); // the wall has none
    }
}

TEST(Cost, OnlyWhatMovesCarriesTimeSteps) {
    const std::string moving = "ActiveTransform EndTime\nTranslate .1 0 0\nActiveTransform All\n";
    const auto steps = [](const std::string& world) {
        return test::build(head(kDirect) + kPoint + world).scene->tracer().counts();
    };
    EXPECT_EQ(steps(kWall + kBall).timeSteps, 0u);
    EXPECT_EQ(steps(kWall + kBall).instances, 0u);
    const TracerCounts one = steps(kWall + kWall + "AttributeBegin\n" + moving + kBall + "AttributeEnd\n");
    EXPECT_EQ(one.timeSteps, 2u);
    EXPECT_EQ(one.triangles, 4u);
    // A shutter that is open for no time, and keys outside the shutter, make everything rest.
    const std::string instant = "Camera \"perspective\" \"float shutteropen\" .5 \"float shutterclose\" .5\n";
    const std::string early = "TransformTimes -2 -1\n";
    const std::string world = "WorldBegin\n" + kPoint + moving + kBall + kWall;
    EXPECT_EQ(test::build(instant + world).scene->tracer().counts().timeSteps, 0u);
    EXPECT_EQ(test::build(early + "Camera \"perspective\"\n" + world).scene->tracer().counts().timeSteps, 0u);
    EXPECT_EQ(test::build("Camera \"perspective\"\n" + world).scene->tracer().counts().timeSteps, 4u);
}

TEST(Cost, AMovingThingCostsNothingElsewhere) {
    // The left half of the picture does not see the moving ball, and its point light's shadow does not fall
    // there.
    const std::string start = head(kDirect) + "LightSource \"point\" \"point from\" [0 0 0]\n" + kWall;
    const std::string ball = "ActiveTransform EndTime\nTranslate .2 0 0\nActiveTransform All\n"
                             "Translate 1.5 0 4\nShape \"sphere\" \"float radius\" .2\n";
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
