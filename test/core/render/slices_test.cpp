// Any split of pixels and samples adds up to the whole, to the bit.
#include "core/math/hash.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

const char* const kScene =
    "TransformTimes 0 1\nFilm \"image\" \"integer xresolution\" 27 \"integer yresolution\" 21\n"
    "PixelFilter \"mitchell\"\nSampler \"sobol\" \"integer pixelsamples\" 16\n"
    "Integrator \"path\" \"integer maxdepth\" 2\n"
    "LookAt 0 2 -6 0 .5 0 0 1 0\nCamera \"perspective\" \"float fov\" 50\n"
    "WorldBegin\nLightSource \"infinite\" \"rgb L\" [.3 .4 .5]\n"
    "AttributeBegin\nTranslate 2 4 -2\nAreaLightSource \"diffuse\" \"rgb L\" [20 20 20]\n"
    "Shape \"sphere\" \"float radius\" .5\nAttributeEnd\nMaterial \"matte\" \"rgb Kd\" [.5 .6 .7]\n"
    "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 9]\n"
    "AttributeBegin\nTranslate -1 1 0\nActiveTransform EndTime\nTranslate .8 0 0\nActiveTransform All\n"
    "Shape \"sphere\" \"float radius\" .9\nAttributeEnd\n";

struct Sharing {
    const char* integrator;
    std::vector<std::string> defines = {};
};
const Sharing kIntegrators[] = {{"supersample"},
                                {"msaa"},
                                {"msaa", {"shades=3"}},
                                {"msaa-cache"},
                                {"msaa-cache", {"blocksize=2", "interpolate=nearest"}},
                                {"indirect-cache"}};

BuiltScene buildWith(const Sharing& sharing) {
    BuildOptions options;
    options.integrator = sharing.integrator;
    options.defines = sharing.defines;
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
    film.keepSums();
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

TEST(Slices, SixteenRandomSplitsAddUpToTheWhole) {
    for (const Sharing& sharing : kIntegrators) {
        const BuiltScene built = buildWith(sharing);
        const Image whole = test::render(built, 3).image;
        for (uint64_t split = 0; split < 16; ++split) {
            const uint64_t h = hashOf(split, 77);
            const int x = 1 + int(h % 25);                             // two windows beside each other,
            const uint32_t a = 1 + h / 32 % 15, b = 1 + h / 1024 % 15; // each in two slices of its own
            Film film = emptyFilm(built, built.pixelBounds);
            for (const auto& [pixelBounds, cut] :
                 {std::pair(PixelBounds{x, 0, 27, 21}, a), std::pair(PixelBounds{0, 0, x, 21}, b)})
                for (const SampleSlice slice : {SampleSlice{cut, 16}, SampleSlice{0, cut}}) {
                    Film slicePicture = emptyFilm(built, pixelBounds);
                    RenderSettings settings = settingsOf(built);
                    settings.slice = slice;
                    renderInto(built, settings, slicePicture);
                    film.add(slicePicture);
                }
            EXPECT_TRUE(sameBits(film.image(), whole)) << sharing.integrator << ", split " << split;
            EXPECT_EQ(film.sums()[0].good(), 16u);
        }
    }
}

TEST(Slices, OneRendererGoesOnSliceBySlice) {
    for (const Sharing& sharing : kIntegrators) {
        const BuiltScene built = buildWith(sharing);
        Film film = emptyFilm(built, built.pixelBounds);
        Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                          *built.filter, settingsOf(built), built.pixelBounds);
        for (const SampleSlice slice :
             {SampleSlice{0, 1}, SampleSlice{1, 2}, SampleSlice{2, 9}, SampleSlice{9, 16}}) {
            renderer.continueWith(slice);
            EXPECT_TRUE(renderer.render(film));
        }
        EXPECT_TRUE(sameBits(film.image(), test::render(built, 3).image)) << sharing.integrator;
        EXPECT_EQ(renderer.stats().total.pixels, 27u * 21u);
    }
}

TEST(Slices, ASliceShadesNoMoreThanItNeeds) {
    const BuiltScene built = buildWith({"msaa"});
    RenderSettings settings = settingsOf(built);
    settings.slice = SampleSlice{0, 1};
    Film film = emptyFilm(built, built.pixelBounds);
    const Counters c = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                              *built.filter, settings, film)
                           .total;
    EXPECT_LE(c.shades + c.missed, c.pixels) << "one group per pixel has the sample";
    EXPECT_EQ(c.visibilitySamples, c.pixels * 16) << "the groups are those of all";
}

TEST(Slices, ARestartedRendererIsAFreshOne) {
    for (const Sharing& sharing : kIntegrators) {
        const BuiltScene built = buildWith(sharing);
        Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                          *built.filter, settingsOf(built), built.pixelBounds);
        Film first(27, 21, built.pixelBounds), second(27, 21, built.pixelBounds),
            plain(27, 21, built.pixelBounds);
        renderer.render(first);
        renderer.restart(9, 4);
        renderer.render(second);
        RenderSettings settings = settingsOf(built);
        settings.seed = 9;
        settings.samplesPerPixel = 4;
        renderInto(built, settings, plain);
        EXPECT_TRUE(sameBits(second.image(), plain.image())) << sharing.integrator;
        EXPECT_FALSE(sameBits(second.image(), first.image())) << sharing.integrator;
    }
}

TEST(Slices, WhatCannotBeSlicedSaysSo) {
    const auto messageFor = [](const Sharing& sharing, SampleSlice slice) -> std::string {
        const BuiltScene built = buildWith(sharing);
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
    EXPECT_EQ(
        messageFor({"msaa-cache", {"scope=tile"}}, {0, 8}),
        "the samples of this integrator depend on the course of the render: there are no slices of them");
    EXPECT_EQ(messageFor({"msaa"}, {8, 17}), "samples 8:17: a pixel has 16");
    EXPECT_EQ(messageFor({"msaa"}, {8, 8}), "samples 8:8: a pixel has 16");
}

TEST(Slices, StopLeavesTheRestOut) {
    const BuiltScene built = buildWith({"supersample"});
    RenderSettings settings = settingsOf(built);
    std::atomic<int> asked{0};
    settings.stop = [&] { return ++asked > 5; };
    Film film(27, 21, built.pixelBounds);
    Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                      settings, built.pixelBounds);
    EXPECT_FALSE(renderer.render(film));
    EXPECT_LE(renderer.stats().total.pixels, 5u * 64u);
    EXPECT_GT(renderer.stats().total.pixels, 0u);
}

} // namespace
} // namespace strobe
