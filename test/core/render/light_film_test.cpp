// Parts of the light: they add up to the picture, and each is what its name says.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

namespace strobe {
namespace {

/// Channels by name.
using Layers = std::map<std::string, std::vector<float>>;

struct Lit {
    Layers layers;
    Film film;
    RenderStats stats;
};

BuildOptions with(const std::string& integrator, const std::string& shading = "") {
    BuildOptions options;
    options.integrator = integrator;
    options.shading = shading;
    return options;
}

Lit light(const std::string& text, const BuildOptions& options, std::vector<Aov> wanted, uint64_t seed = 0,
          int threads = 2, int tile = 8) {
    const BuiltScene built = test::build(text, options);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    settings.threads = threads, settings.tileSize = tile;
    LightFilm components(built.pixelBounds, wanted, built.lightGroups);
    settings.lights = wanted.empty() ? nullptr : &components;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                               *built.filter, settings, film);
    Layers layers;
    for (AovChannel& channel : components.channels())
        layers[channel.layer + '.' + channel.name] = std::move(channel.values);
    return {std::move(layers), std::move(film), std::move(stats)};
}

const std::vector<Aov> kAll = {Aov::Direct, Aov::Indirect, Aov::LightGroups};

/// Everything that light can do here: lamps that are seen, mirrors, glass, gloss, textures, motion.
std::string room(const std::string& lights) {
    return "TransformTimes 0 1\nFilm \"image\" \"integer xresolution\" 30 \"integer yresolution\" "
           "20\nSampler "
           "\"sobol\" \"integer pixelsamples\" 16\nPixelFilter \"mitchell\"\nIntegrator \"path\" \"integer "
           "maxdepth\" 5\nLookAt 0 2 -6 0 .8 0 0 1 0\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\n" +
           lights +
           "Texture \"checks\" \"rgb\" \"checkerboard\" \"rgb tex1\" [.8 .7 .6] \"rgb tex2\" [.2 .3 .5]\n"
           "Material \"matte\" \"texture Kd\" \"checks\"\nShape \"trianglemesh\" \"integer indices\" [0 2 1 "
           "0 "
           "3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 9]\n"
           "AttributeBegin\nMaterial \"mirror\"\nTranslate -1.6 .7 0\nShape \"sphere\" \"float radius\" "
           ".7\nAttributeEnd\n"
           "AttributeBegin\nMaterial \"glass\"\nTranslate .2 .5 -1.5\nShape \"sphere\" \"float radius\" "
           ".5\nAttributeEnd\n"
           "AttributeBegin\nMaterial \"plastic\" \"rgb Kd\" [.5 .2 .1]\nTranslate 1.2 .7 0\nActiveTransform "
           "EndTime\nTranslate .5 0 0\nActiveTransform All\nShape \"sphere\" \"float radius\" "
           ".7\nAttributeEnd\n";
}
const std::string kSky = "LightSource \"infinite\" \"rgb L\" [.3 .4 .5] \"string group\" \"sky\"\n";
const std::string kBall = "Shape \"sphere\" \"float radius\" .6\nAttributeEnd\n";
const std::string kPlace = "AttributeBegin\nTranslate 2 3 1\n";
const std::string kLamp =
    kPlace + "AreaLightSource \"diffuse\" \"rgb L\" [20 18 15] \"string group\" \"lamp\"\n" + kBall;
const std::string kDarkLamp = kPlace + kBall;
const std::string kPoint = "LightSource \"point\" \"point from\" [-3 4 -2] \"rgb I\" [6 5 4]\n";

double valueOf(const Layers& layers, const std::string& layer, size_t at, int c) {
    return double(layers.at(layer + '.' + "RGB"[c])[at]);
}

TEST(LightLayers, AddUpToThePicture) {
    const std::string text = room(kSky + kLamp + kPoint);
    for (const char* shading : {"path", "directlighting"})
        for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
            const Lit lit = light(text, with(integrator, shading), kAll);
            ASSERT_EQ(lit.layers.size(), 15u) << "direct, indirect, sky, lamp, rest";
            const Image& image = lit.film.image();
            for (size_t i = 0; i < image.pixels.size(); ++i)
                for (int c = 0; c < 3; ++c) {
                    const auto part = [&](const char* name) { return valueOf(lit.layers, name, i, c); };
                    const double whole = image.pixels[i][c];
                    EXPECT_NEAR(part("direct") + part("indirect"), whole, 1e-5 * (std::abs(whole) + 1))
                        << integrator << ' ' << shading << ", pixel " << i;
                    EXPECT_NEAR(part("light_sky") + part("light_lamp") + part("light_rest"), whole,
                                1e-5 * (std::abs(whole) + 1))
                        << integrator << ' ' << shading << ", pixel " << i;
                }
        }
}

TEST(LightLayers, ChangeNeitherThePictureNorTheWork) {
    const std::string text = room(kSky + kLamp + kPoint);
    for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
        BuildOptions options = with(integrator);
        if (std::string(integrator).find("cache") != std::string::npos)
            options.defines = {"cache-mb=64"};
        const Lit without = light(text, options, {}, 0, 1), split = light(text, options, kAll, 0, 1);
        EXPECT_EQ(0, std::memcmp(without.film.image().pixels.data(), split.film.image().pixels.data(),
                                 without.film.image().pixels.size() * sizeof(Rgb)))
            << integrator;
        EXPECT_EQ(without.stats.total.rays(), split.stats.total.rays()) << integrator;
        EXPECT_EQ(without.stats.total.shades, split.stats.total.shades) << integrator;
    }
}

TEST(LightLayers, DoNotDependOnThreadsAndTiles) {
    const std::string text = room(kSky + kLamp + kPoint);
    for (const char* integrator : {"supersample", "msaa-cache", "indirect-cache"})
        EXPECT_TRUE(light(text, with(integrator), kAll, 0, 1, 30).layers ==
                    light(text, with(integrator), kAll, 0, 3, 5).layers)
            << integrator;
}

TEST(LightLayers, ASmallCacheGivesTheSameParts) {
    const std::string text = room(kSky + kLamp + kPoint);
    BuildOptions small = with("msaa-cache");
    small.defines = {"cache-mb=0.001"};
    EXPECT_TRUE(light(text, with("msaa-cache"), kAll).layers == light(text, small, kAll).layers);
}

/// Means of all pixels over seeds, and their standard errors, of a picture's channels.
using Means = std::array<test::Estimate, 3>;

template <class ValuesOf>
Means meansOver(int seeds, const ValuesOf& valuesOf) {
    double sum[3] = {}, sum2[3] = {};
    for (int s = 0; s < seeds; ++s) {
        const std::array<double, 3> mean = valuesOf(uint64_t(s));
        for (size_t c = 0; c < 3; ++c)
            sum[c] += mean[c], sum2[c] += mean[c] * mean[c];
    }
    Means means;
    for (size_t c = 0; c < 3; ++c) {
        const double mean = sum[c] / seeds;
        means[c] = {mean, std::sqrt(std::max(0.0, sum2[c] / seeds - mean * mean) / (seeds - 1))};
    }
    return means;
}

Means meansOfPicture(const std::string& text, const BuildOptions& options, int seeds) {
    return meansOver(seeds, [&](uint64_t seed) {
        const Lit lit = light(text, options, {}, seed);
        std::array<double, 3> mean{};
        for (const Rgb& pixel : lit.film.image().pixels)
            for (int c = 0; c < 3; ++c)
                mean[size_t(c)] += pixel[c] / double(lit.film.image().pixels.size());
        return mean;
    });
}

Means meansOfLayer(const std::string& text, const BuildOptions& options, Aov wanted, const std::string& layer,
                   int seeds) {
    return meansOver(seeds, [&](uint64_t seed) {
        const Lit lit = light(text, options, {wanted}, seed + 1000);
        std::array<double, 3> mean{};
        for (size_t c = 0; c < 3; ++c)
            for (const float v : lit.layers.at(layer + '.' + "RGB"[c]))
                mean[c] += double(v) / 600;
        return mean;
    });
}

void expectEqual(const Means& a, const Means& b, int seeds, const std::string& what) {
    const double z = test::criticalZ(6, seeds);
    for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(a[c].mean, b[c].mean, z * std::hypot(a[c].error, b[c].error))
            << what << ", channel " << c;
}

TEST(LightLayers, AGroupIsThePictureOfItsLightsAlone) {
    constexpr int kSeeds = 12;
    const std::string all = room(kSky + kLamp + kPoint);
    for (const auto& [layer, lights] : {std::pair("light_sky", kSky), std::pair("light_rest", kPoint)})
        expectEqual(meansOfLayer(all, with("supersample"), Aov::LightGroups, layer, kSeeds),
                    meansOfPicture(room(lights + kDarkLamp), with("supersample"), kSeeds), kSeeds, layer);
}

TEST(LightLayers, DirectIsThePictureOfDirectLighting) {
    constexpr int kSeeds = 12;
    const std::string text = room(kSky + kLamp + kPoint);
    BuildOptions path = with("supersample", "path"), direct = with("supersample", "directlighting");
    path.defines = direct.defines = {"maxdepth=12"}; // mirrors and glass are counted a little differently
    expectEqual(meansOfLayer(text, path, Aov::Direct, "direct", kSeeds), meansOfPicture(text, direct, kSeeds),
                kSeeds, "direct");
    // ... and direct lighting has no other.
    const Lit lit = light(text, direct, {Aov::Indirect});
    EXPECT_EQ(lit.layers.size(), 3u) << "only what was asked for";
    for (const float v : lit.layers.at("indirect.R"))
        EXPECT_EQ(v, 0);
}

TEST(LightLayers, CachesThatFirstRaysDecideHaveNone) {
    BuildOptions options = with("msaa-cache");
    options.defines = {"scope=thread"};
    try {
        light(room(kSky), options, kAll);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind, ErrorKind::Usage);
        EXPECT_STREQ(e.what(),
                     "scope thread, mutex and tile do not support layers of direct light, indirect light "
                     "and light groups: use scope shared or another integrator");
    }
}

TEST(LightLayers, GroupsAreNamesOfLayers) {
    try {
        test::build(room("LightSource \"infinite\" \"string group\" \"key light\"\n"));
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "\"group\" names a layer: letters, digits and underscores, not \"key light\"");
    }
}

} // namespace
} // namespace strobe
