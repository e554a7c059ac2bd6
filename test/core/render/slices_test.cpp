// Slices of samples and crops of pixels add up to the whole image, to the bit.
#include "core/math/hash.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

/// Motion, an area light, shadows.
const std::string kScene = R"(
    TransformTimes 0 1
    Film "image" "integer xresolution" 27 "integer yresolution" 21
    PixelFilter "mitchell"
    Sampler "sobol" "integer pixelsamples" 16
    Integrator "path" "integer maxdepth" 2
    LookAt 0 2 -6  0 .5 0  0 1 0
    Camera "perspective" "float fov" 50
    WorldBegin
    LightSource "infinite" "rgb L" [.3 .4 .5]
    AttributeBegin
      Translate 2 4 -2
      AreaLightSource "diffuse" "rgb L" [20 20 20]
      Shape "sphere" "float radius" .5
    AttributeEnd
    Material "matte" "rgb Kd" [.5 .6 .7]
    Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
    AttributeBegin
      Translate -1 1 0
      ActiveTransform EndTime
      Translate .8 0 0
      ActiveTransform All
      Shape "sphere" "float radius" .9
    AttributeEnd
)";

struct IntegratorCase {
    const char* name;
    std::vector<std::string> defines = {};
};
const IntegratorCase kIntegrators[] = {{"supersample"},
                                       {"msaa"},
                                       {"msaa", {"shades=3"}},
                                       {"msaa-cache"},
                                       {"msaa-cache", {"blocksize=2", "interpolate=nearest"}},
                                       {"indirect-cache"}};

BuiltScene buildWith(const IntegratorCase& integrator) {
    BuildOptions options;
    options.integrator = integrator.name;
    options.defines = integrator.defines;
    return test::build(kScene, options);
}

RenderSettings settingsOf(const BuiltScene& built) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = 3;
    settings.threads = 2;
    settings.tileSize = 8;
    return settings;
}

Film emptyFilm(const BuiltScene& built, const PixelBounds& pixelBounds) {
    Film film(built.resolution.x, built.resolution.y, pixelBounds);
    film.enableAccumulation();
    return film;
}

void renderInto(const BuiltScene& built, const RenderSettings& settings, Film& film) {
    render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter, settings,
           film);
}

bool sameBits(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height &&
           !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

TEST(Slices, RandomSplitsAddUpToTheWholeImage) {
    for (const IntegratorCase& integrator : kIntegrators) {
        const BuiltScene built = buildWith(integrator);
        const Image whole = test::render(built, 3).image;
        for (uint64_t split = 0; split < 16; ++split) {
            const uint64_t h = hashOf(split, 77);
            // Two adjacent crops, each in two slices of its own.
            const int x = 1 + int(h % 25);
            const uint32_t cutRight = 1 + h / 32 % 15, cutLeft = 1 + h / 1024 % 15;
            Film film = emptyFilm(built, built.pixelBounds);
            for (const auto& [pixelBounds, cut] : {std::pair(PixelBounds{x, 0, 27, 21}, cutRight),
                                                   std::pair(PixelBounds{0, 0, x, 21}, cutLeft)})
                for (const SampleSlice slice : {SampleSlice{cut, 16}, SampleSlice{0, cut}}) {
                    Film sliceFilm = emptyFilm(built, pixelBounds);
                    RenderSettings settings = settingsOf(built);
                    settings.slice = slice;
                    renderInto(built, settings, sliceFilm);
                    film.merge(sliceFilm);
                }
            EXPECT_TRUE(sameBits(film.image(), whole)) << integrator.name << ", split " << split;
            EXPECT_EQ(film.sums()[0].validCount(), 16u);
        }
    }
}

TEST(Slices, ARendererCanRenderSliceBySlice) {
    for (const IntegratorCase& integrator : kIntegrators) {
        const BuiltScene built = buildWith(integrator);
        Film film = emptyFilm(built, built.pixelBounds);
        Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                          *built.filter, settingsOf(built), built.pixelBounds);
        for (const SampleSlice slice :
             {SampleSlice{0, 1}, SampleSlice{1, 2}, SampleSlice{2, 9}, SampleSlice{9, 16}}) {
            renderer.setSlice(slice);
            EXPECT_TRUE(renderer.render(film));
        }
        EXPECT_TRUE(sameBits(film.image(), test::render(built, 3).image)) << integrator.name;
        EXPECT_EQ(renderer.stats().total.pixels, 27u * 21u);
    }
}

TEST(Slices, ASliceShadesOnlyTheGroupsOfItsSamples) {
    const BuiltScene built = buildWith({"msaa"});
    RenderSettings settings = settingsOf(built);
    settings.slice = SampleSlice{0, 1};
    Film film = emptyFilm(built, built.pixelBounds);
    const Counters c = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                              *built.filter, settings, film)
                           .total;
    EXPECT_LE(c.shades + c.missed, c.pixels) << "the sample is in one group per pixel";
    EXPECT_EQ(c.visibilitySamples, c.pixels * 16) << "groups are formed from all samples";
}

TEST(Slices, ARestartedRendererEqualsANewOne) {
    for (const IntegratorCase& integrator : kIntegrators) {
        const BuiltScene built = buildWith(integrator);
        Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                          *built.filter, settingsOf(built), built.pixelBounds);
        Film first(27, 21, built.pixelBounds);
        Film second(27, 21, built.pixelBounds);
        Film expected(27, 21, built.pixelBounds);
        renderer.render(first);
        renderer.restart(9, 4);
        renderer.render(second);
        RenderSettings settings = settingsOf(built);
        settings.seed = 9;
        settings.samplesPerPixel = 4;
        renderInto(built, settings, expected);
        EXPECT_TRUE(sameBits(second.image(), expected.image())) << integrator.name;
        EXPECT_FALSE(sameBits(second.image(), first.image())) << integrator.name;
    }
}

TEST(Slices, ErrorsForInvalidSlices) {
    const auto messageFor = [](const IntegratorCase& integrator, SampleSlice slice) -> std::string {
        const BuiltScene built = buildWith(integrator);
        RenderSettings settings = settingsOf(built);
        settings.slice = slice;
        Film film = emptyFilm(built, built.pixelBounds);
        try {
            renderInto(built, settings, film);
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            return e.what();
        }
        return "";
    };
    EXPECT_EQ(messageFor({"msaa-cache", {"scope=tile"}}, {0, 8}),
              "this integrator's samples depend on other pixels or on the order of rendering and cannot be "
              "rendered in slices");
    EXPECT_EQ(messageFor({"msaa"}, {8, 17}), "samples 8:17: a pixel has 16 samples");
    EXPECT_EQ(messageFor({"msaa"}, {8, 8}), "samples 8:8: a pixel has 16 samples");
}

TEST(Slices, StopSkipsTheRemainingBatches) {
    const BuiltScene built = buildWith({"supersample"});
    RenderSettings settings = settingsOf(built);
    std::atomic<int> calls{0};
    settings.stop = [&] { return ++calls > 5; };
    Film film(27, 21, built.pixelBounds);
    Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                      settings, built.pixelBounds);
    EXPECT_FALSE(renderer.render(film));
    EXPECT_LE(renderer.stats().total.pixels, 5u * 64u);
    EXPECT_GT(renderer.stats().total.pixels, 0u);
}

} // namespace
} // namespace strobe
