// adaptive-cache against supersample.
#include "core/render/passes.h"
#include "integrators/sharing_support.h"
#include "support/fence_scene.h"
#include "support/scene_files.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::clippedError;
using test::haveEqualBits;
using test::oneLampFrame;
using test::render;
using test::renderInPasses;
using test::renderInSlices;

/// A diffuse corner with a moving ball under a lamp that the camera sees.
std::string makeScene(int samples, const std::string& shading) {
    return test::lampFrame(48, 36, samples, shading) + test::kCorner;
}

/// The decision of the pilot does not matter to most tests.
const std::vector<std::string> kSharing = {"share=both"};

BuiltScene buildScene(const std::string& integrator, int samples, const std::string& shading = "path") {
    return test::buildWith(integrator, makeScene(samples, shading),
                           integrator == "adaptive-cache" ? kSharing : std::vector<std::string>{});
}

/// A small frame of paths, before the camera and the world.
constexpr const char* kFrame = R"(
Film "image" "integer xresolution" 48 "integer yresolution" 36
Sampler "sobol" "integer pixelsamples" 16
Integrator "path"
)";

/// Direct light of a distant light on a plane, and a mirror: there is noise at edges only, where no estimate
/// of another pixel is better than a pixel's own.
TEST(AdaptiveCache, IsSupersampleWhereSharingCannotPay) {
    const std::string scene = std::string(kFrame) + R"(
Integrator "directlighting"
LookAt 0 2 -6  0 1 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "distant" "point from" [1 3 -2] "point to" [0 0 0] "rgb L" [2 2 2]
Material "matte"
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
Material "mirror"
Translate 0 1 0
Shape "sphere" "float radius" 1
)";
    const auto adaptive = render(test::buildWith("adaptive-cache", scene, {"sampling=uniform"}));
    EXPECT_TRUE(haveEqualBits(adaptive.image, render(test::buildWith("supersample", scene)).image));
    EXPECT_EQ(adaptive.stats.integratorNote, "shares no light: equals supersample");
}

TEST(AdaptiveCache, IsSupersampleWhereSharingTakesTooMuchMemory) {
    // No lamp is seen, whose emission would be refined.
    const std::string kLit = R"(LightSource "point" "point from" [0 1.5 .5] "rgb I" [4 4 4])";
    for (const int samples : {1, 4}) { // without and with a pilot
        const std::string scene = test::frontView(samples, kLit + test::kCorner, "path");
        const auto adaptive = [&](const std::string& size) {
            return render(test::buildWith("adaptive-cache", scene, {"share=both", "sampling=uniform", size}));
        };
        const auto refused = adaptive("cache-mb=0.1");
        EXPECT_TRUE(haveEqualBits(refused.image, render(test::buildWith("supersample", scene)).image));
        EXPECT_TRUE(refused.stats.integratorNote.starts_with("shares no light, which would take "))
            << refused.stats.integratorNote;
        EXPECT_EQ(refused.stats.total.cacheBytes, 0u);
        for (const char* const size : {"cache-mb=64", "cache-mb=unbounded", "cache-mb=auto"}) {
            const auto shared = adaptive(size);
            EXPECT_EQ(shared.stats.integratorNote, "shares direct and indirect light") << size;
            EXPECT_GT(shared.stats.total.cacheBytes, 100'000u); // of cache-mb=0.1
        }
    }
    EXPECT_THROW(test::buildWith("adaptive-cache", makeScene(4, "path"), {"cache-mb=-1"}), Error);
}

/// Nothing but a mirror in front of a constant environment, or a surface without light.
TEST(AdaptiveCache, IsSupersampleWithoutLightOnSurfaces) {
    for (const char* const world :
         {R"(LightSource "infinite" "rgb L" [1 1 1] Material "mirror")", R"(Material "matte")"}) {
        const std::string scene = std::string(kFrame) + R"(
LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
)" + std::string(world) + " Shape \"sphere\" \"float radius\" 1\n";
        const auto adaptive = render(test::buildWith("adaptive-cache", scene));
        EXPECT_TRUE(haveEqualBits(adaptive.image, render(test::buildWith("supersample", scene)).image));
        EXPECT_EQ(adaptive.stats.integratorNote, "shares no light: equals supersample") << world;
    }
}

/// A plane under a distant light: there is no noise, so that no block takes more samples.
TEST(AdaptiveCache, IsSupersampleWithoutNoise) {
    const std::string scene = std::string(kFrame) + R"(
LookAt 0 2 0  0 0 0  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
LightSource "distant" "point from" [1 3 -2] "point to" [0 0 0] "rgb L" [2 2 2]
Material "matte"
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
)";
    const auto adaptive = render(test::buildWith("adaptive-cache", scene));
    EXPECT_TRUE(haveEqualBits(adaptive.image, render(test::buildWith("supersample", scene)).image));
    EXPECT_EQ(adaptive.stats.integratorNote, "shares no light: equals supersample");
}

TEST(AdaptiveCache, ThePilotSharesWhereItPays) {
    const Image reference = render(test::buildWith("supersample", makeScene(1024, "path")), 99).image;
    for (const int samples : {4, 16}) {
        const std::string scene = makeScene(samples, "path");
        const auto adaptive = render(test::buildWith("adaptive-cache", scene));
        EXPECT_EQ(adaptive.stats.integratorNote.find("no light"), std::string::npos) << samples;
        EXPECT_LT(clippedError(adaptive.image, reference),
                  0.5 * clippedError(render(test::buildWith("supersample", scene)).image, reference))
            << samples;
    }
}

/// The sum of the image is given back to pixels that have an error.
TEST(AdaptiveCache, ABackgroundWithoutNoiseStays) {
    std::string scene = makeScene(16, "path");
    scene.replace(scene.find("LookAt"), 22, "LookAt 0 6 -16  0 7 0");
    const Image adaptive = render(test::buildWith("adaptive-cache", scene, kSharing)).image;
    const Image own = render(test::buildWith("supersample", scene)).image;
    EXPECT_FALSE(haveEqualBits(adaptive, own));
    int count = 0, changed = 0;
    for (size_t i = 0; i < own.pixels.size(); ++i) {
        const bool isBackground = own.pixels[i] == own.pixels.front();
        count += isBackground;
        changed += isBackground && !(adaptive.pixels[i] == own.pixels[i]);
    }
    EXPECT_GT(count, 100);
    EXPECT_EQ(changed, 0);
}

/// Returns 24 spheres of light at the height y = 2.
std::string manyLamps() {
    std::string text;
    for (int i = 0; i < 24; ++i)
        text += "AttributeBegin Translate " + std::to_string(i % 6 - 2.5) + " 2 " + std::to_string(i / 6) +
                " AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] Shape \"sphere\" \"float radius\" .2 "
                "AttributeEnd\n";
    return text;
}

/// Each sample chooses one of 24 lamps: the noise is large, and the light smooth.
TEST(AdaptiveCache, SharesDirectLight) {
    const auto scene = [](int samples) {
        return oneLampFrame(samples) + R"(
LookAt 0 2 -6  0 1 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
Material "matte"
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
)" + manyLamps();
    };
    const Image reference = render(test::buildWith("supersample", scene(4096)), 99).image;
    const auto errorOf = [&](const char* integrator, std::vector<std::string> defines = {}) {
        double sum = 0;
        for (uint64_t seed = 0; seed < 4; ++seed)
            sum +=
                clippedError(render(test::buildWith(integrator, scene(16), defines), seed).image, reference);
        return sum;
    };
    EXPECT_LT(errorOf("adaptive-cache", {"share=direct"}), 0.6 * errorOf("supersample"));
}

/// With 300x225 pixels, the first five blocks of the pilot have a 500th of the noise that its pairs show.
/// Sharing indirect light gains more than 40 in all of these sizes.
TEST(AdaptiveCache, LooksAtMoreBlocksIfTheFirstMissTheNoise) {
    for (const int width : {240, 280, 300, 320, 360}) {
        BuildOptions options;
        options.integrator = "adaptive-cache";
        options.resolution = {width, width * 3 / 4};
        options.samplesPerPixel = 4;
        options.shading = "path";
        const BuiltScene built =
            test::buildFile(test::kSource / "scenes/stress/spot-near-miss.scene", options);
        EXPECT_NE(render(built).stats.integratorNote.find("shares indirect light"), std::string::npos)
            << width;
    }
}

/// A plane of 24x24 squares under 24 lamps, as one mesh and as a mesh for each square, as some programs write
/// them.
TEST(AdaptiveCache, MeshesOfOneMaterialShareLight) {
    const auto renderSquares = [](bool isDivided) {
        std::string text = oneLampFrame(4) + R"(
LookAt 0 4 -6  0 0 1  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
)";
        text += manyLamps() + "Material \"matte\"\n";
        constexpr int kSquares = 24;
        std::string points, indices;
        for (int i = 0; i < kSquares * kSquares; ++i) {
            const auto corner = [&](int x, int z) {
                return std::to_string((i % kSquares + x) * .5 - 6) + " 0 " +
                       std::to_string((i / kSquares + z) * .5 - 6) + "  ";
            };
            points += corner(0, 0) + corner(1, 0) + corner(1, 1) + corner(0, 1);
            for (const int k : {0, 2, 1, 0, 3, 2})
                indices += std::to_string((isDivided ? 0 : 4 * i) + k) + ' ';
            if (isDivided || i == kSquares * kSquares - 1) {
                text += "Shape \"trianglemesh\" \"integer indices\" [" + indices + "] \"point P\" [" +
                        points + "]\n";
                points.clear();
                indices.clear();
            }
        }
        return render(test::buildWith("adaptive-cache", text, {"share=direct", "sampling=uniform"})).image;
    };
    EXPECT_TRUE(haveEqualBits(renderSquares(false), renderSquares(true)));
}

TEST(AdaptiveCache, DoesNotDependOnThreadsAndTiles) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    const Image image = render(built, 0, 1, 48).image;
    for (const auto& [threads, tile] : {std::pair(2, 16), {7, 5}, {3, 1}})
        EXPECT_TRUE(haveEqualBits(render(built, 0, threads, tile).image, image)) << threads << " " << tile;
}

TEST(AdaptiveCache, DoesNotDependOnSlices) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    const auto whole = render(built);
    EXPECT_NE(whole.stats.integratorNote, "shares no light: equals supersample");
    for (const std::vector<uint32_t>& ends : {std::vector<uint32_t>{16}, {8, 16}, {1, 2, 5, 13, 16}})
        EXPECT_TRUE(haveEqualBits(renderInSlices(built, ends).image(), whole.image)) << ends.size();
}

/// With a lens, the size of cells depends on the spread of the pixel's samples.
TEST(AdaptiveCache, DoesNotDependOnSlicesWithALens) {
    std::string scene = makeScene(16, "path");
    scene.replace(scene.find("\"float fov\" 50"), 14,
                  "\"float fov\" 50 \"float lensradius\" .2 \"float focaldistance\" 4");
    const BuiltScene built = test::buildWith("adaptive-cache", scene, kSharing);
    const auto whole = render(built);
    EXPECT_NE(whole.stats.integratorNote, "shares no light: equals supersample");
    EXPECT_TRUE(haveEqualBits(renderInSlices(built, {2, 3, 16}).image(), whole.image));
}

TEST(AdaptiveCache, IsCompletedWithoutTheScene) {
    const BuiltScene built = test::buildWith("adaptive-cache", makeScene(16, "path"), kSharing);
    const Film film = renderInSlices(built, {3, 16});
    const test::MergedImages merged = test::mergeFilm(built, film);
    EXPECT_FALSE(haveEqualBits(merged.incomplete, film.image()));
    EXPECT_TRUE(haveEqualBits(merged.completed, film.image()));
}

TEST(AdaptiveCache, DoublingSlicesEqualOneRender) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    RenderSettings settings;
    settings.samplesPerPixel = 16;
    renderDoubling(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                   settings, film, [](const Film&, const RenderStats&) { return std::nullopt; });
    EXPECT_TRUE(haveEqualBits(film.image(), render(built).image));
    EXPECT_EQ(film.records().all().size(), 4u) << "slices of a tile are merged";
}

/// Some images are so small that they contain none of the pixels that the pilot looks at. The lamp is hidden:
/// its correction has noise of its own.
TEST(AdaptiveCache, ImagesMayHaveFewPixels) {
    for (const auto& [width, height] : {std::pair(1, 1), {2, 1}, {1, 7}, {19, 2}, {3, 9}}) {
        std::string scene = makeScene(4, "path");
        scene.replace(scene.find("Translate 1.2 2.6 0"), 19, "Translate 1.2 2.6 -7");
        scene.replace(scene.find("xresolution\" 48"), 15, "xresolution\" " + std::to_string(width));
        scene.replace(scene.find("yresolution\" 36"), 15, "yresolution\" " + std::to_string(height));
        const auto sumOf = [&](const BuiltScene& built) {
            double sum = 0;
            for (const Rgb& pixel : render(built).image.pixels)
                sum += double(pixel.x + pixel.y + pixel.z);
            return sum;
        };
        const double plain = sumOf(test::buildWith("supersample", scene));
        EXPECT_GT(plain, 0);
        EXPECT_NEAR(sumOf(test::buildWith("adaptive-cache", scene, {"share=both", "sampling=uniform"})),
                    plain, 1e-4 * plain)
            << width << " " << height;
    }
}

/// Cells have a smallest and a largest size.
TEST(AdaptiveCache, CellsMayBeOfAnySize) {
    for (const char* size : {"1e-30", "1e30"}) {
        const BuiltScene built = test::buildWith("adaptive-cache", makeScene(4, "path"),
                                                 {"share=both", std::string("cellsize=") + size});
        for (const Rgb& pixel : render(built).image.pixels)
            ASSERT_TRUE(std::isfinite(pixel.x + pixel.y + pixel.z)) << size;
    }
}

/// A film with samples of another decision cannot be continued.
TEST(AdaptiveCache, AnotherDecisionIsAnError) {
    const BuiltScene built = buildScene("adaptive-cache", 16);
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    film.records().setNote("shares no light: equals supersample");
    RenderSettings settings;
    settings.samplesPerPixel = 16;
    EXPECT_THROW(render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                        settings, film),
                 Error);
}

TEST(AdaptiveCache, ReducesTheError) {
    const Image reference = render(buildScene("supersample", 4096), 99).image;
    double shared = 0, own = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        shared += clippedError(render(buildScene("adaptive-cache", 16), seed).image, reference);
        own += clippedError(render(buildScene("supersample", 16), seed).image, reference);
    }
    EXPECT_LT(shared, 0.6 * own);
}

/// Sharing only moves light between pixels. The lamp is hidden: its correction has noise of its own.
TEST(AdaptiveCache, KeepsTheSumOfTheImage) {
    std::string scene = makeScene(16, "path");
    scene.replace(scene.find("Translate 1.2 2.6 0"), 19, "Translate 1.2 2.6 -7");
    const Image a =
        render(test::buildWith("adaptive-cache", scene, {"share=both", "sampling=uniform"})).image;
    const Image b = render(test::buildWith("supersample", scene)).image;
    EXPECT_FALSE(haveEqualBits(a, b));
    double sums[2] = {};
    for (size_t i = 0; i < a.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            sums[0] += double(a.pixels[i][c]);
            sums[1] += double(b.pixels[i][c]);
        }
    EXPECT_NEAR(sums[0], sums[1], 1e-5 * sums[1]);
}

TEST(AdaptiveCache, PassesKeepTheSumOfTheImage) {
    std::string scene = makeScene(5, "path");
    scene.replace(scene.find("Translate 1.2 2.6 0"), 19, "Translate 1.2 2.6 -7");
    const auto sumOf = [&](const char* integrator) {
        std::vector<std::string> defines;
        if (std::string(integrator) == "adaptive-cache")
            defines = {"sampling=uniform"};
        const BuiltScene built = test::buildWith(integrator, scene, defines);
        double sum = 0;
        for (const Rgb& pixel : renderInPasses(built, 3).pixels)
            sum += double(pixel.x + pixel.y + pixel.z);
        return sum;
    };
    const double plain = sumOf("supersample");
    EXPECT_NEAR(sumOf("adaptive-cache"), plain, 1e-5 * plain);
}

TEST(AdaptiveCache, PassesDoNotDependOnTiles) {
    const BuiltScene built = buildScene("adaptive-cache", 5);
    EXPECT_TRUE(haveEqualBits(renderInPasses(built, 3), renderInPasses(built, 3, 7)));
}

/// The film leaves out invalid samples; they must not spread.
TEST(AdaptiveCache, InvalidSamplesDoNotSpread) {
    std::string scene = makeScene(16, "path");
    scene += "Translate 0 1.5 -1 AreaLightSource \"diffuse\" \"rgb L\" [1e30 1e30 1e30] "
             "Shape \"sphere\" \"float radius\" .05\n";
    const auto rendered = render(test::buildWith("adaptive-cache", scene, kSharing));
    EXPECT_GT(rendered.stats.total.invalidSamples, 0u);
    EXPECT_NE(rendered.stats.integratorNote, "shares no light: equals supersample");
    for (const Rgb& pixel : rendered.image.pixels)
        EXPECT_LT(std::abs(pixel.x) + std::abs(pixel.y) + std::abs(pixel.z), 1e15f);
}

TEST(AdaptiveCache, KeepsTheFurnace) {
    const Image image = render(test::buildWith("adaptive-cache", test::kFurnace, kSharing)).image;
    const Image plain = render(test::buildWith("supersample", test::kFurnace)).image;
    double deviation = 0, plainDeviation = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
        deviation += sqr(image.pixels[i].x - 1);
        plainDeviation += sqr(plain.pixels[i].x - 1);
    }
    EXPECT_LE(deviation, plainDeviation + 1e-6);
}

} // namespace
} // namespace strobe
