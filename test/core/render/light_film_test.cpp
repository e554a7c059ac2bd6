// AOVs of light components: they add up to the image, and each equals a render of that light alone.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

namespace strobe {
namespace {

/// Channels by name.
using Layers = std::map<std::string, std::vector<float>>;

struct LightLayers {
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

LightLayers renderLight(const std::string& text, const BuildOptions& options, const std::vector<Aov>& aovs,
                        uint64_t seed = 0, int threads = 2, int tile = 8) {
    const BuiltScene built = test::build(text, options);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    settings.threads = threads;
    settings.tileSize = tile;
    LightFilm lightFilm(built.pixelBounds, aovs, built.lightGroups);
    settings.lights = aovs.empty() ? nullptr : &lightFilm;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                               *built.filter, settings, film);
    Layers layers;
    for (AovChannel& channel : lightFilm.channels())
        layers[channel.layer + '.' + channel.name] = std::move(channel.values);
    return {std::move(layers), std::move(film), std::move(stats)};
}

const std::vector<Aov> kAll = {Aov::Direct, Aov::Indirect, Aov::LightGroups};

/// A scene with visible lamps, mirror, glass, glossy and textured materials, and motion.
std::string room(const std::string& lights) {
    return R"(
        TransformTimes 0 1
        Film "image" "integer xresolution" 30 "integer yresolution" 20
        Sampler "sobol" "integer pixelsamples" 16
        PixelFilter "mitchell"
        Integrator "path" "integer maxdepth" 5
        LookAt 0 2 -6  0 .8 0  0 1 0
        Camera "perspective" "float fov" 50
        WorldBegin
        )" +
           lights + R"(
        Texture "checks" "rgb" "checkerboard" "rgb tex1" [.8 .7 .6] "rgb tex2" [.2 .3 .5]
        Material "matte" "texture Kd" "checks"
        Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
        AttributeBegin
          Material "mirror"
          Translate -1.6 .7 0
          Shape "sphere" "float radius" .7
        AttributeEnd
        AttributeBegin
          Material "glass"
          Translate .2 .5 -1.5
          Shape "sphere" "float radius" .5
        AttributeEnd
        AttributeBegin
          Material "plastic" "rgb Kd" [.5 .2 .1]
          Translate 1.2 .7 0
          ActiveTransform EndTime
          Translate .5 0 0
          ActiveTransform All
          Shape "sphere" "float radius" .7
        AttributeEnd
        )";
}
const std::string kSky = R"(
    LightSource "infinite" "rgb L" [.3 .4 .5] "string group" "sky"
)";
const std::string kPoint = R"(
    LightSource "point" "point from" [-3 4 -2] "rgb I" [6 5 4]
)";
const std::string kLamp = R"(
    AttributeBegin
      Translate 2 3 1
      AreaLightSource "diffuse" "rgb L" [20 18 15] "string group" "lamp"
      Shape "sphere" "float radius" .6
    AttributeEnd
)";
/// The shape of kLamp, without its light.
const std::string kDarkLamp = R"(
    AttributeBegin
      Translate 2 3 1
      Shape "sphere" "float radius" .6
    AttributeEnd
)";

double valueOf(const Layers& layers, const std::string& layer, size_t pixel, int c) {
    return double(layers.at(layer + '.' + "RGB"[c])[pixel]);
}

TEST(LightFilm, ComponentsAddUpToTheImage) {
    const std::string text = room(kSky + kLamp + kPoint);
    for (const char* shading : {"path", "directlighting"})
        for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
            const LightLayers rendered = renderLight(text, with(integrator, shading), kAll);
            ASSERT_EQ(rendered.layers.size(), 15u) << "direct, indirect, sky, lamp, rest";
            const Image& image = rendered.film.image();
            for (size_t i = 0; i < image.pixels.size(); ++i)
                for (int c = 0; c < 3; ++c) {
                    const auto component = [&](const char* name) {
                        return valueOf(rendered.layers, name, i, c);
                    };
                    const double whole = image.pixels[i][c];
                    EXPECT_NEAR(component("direct") + component("indirect"), whole,
                                1e-5 * (std::abs(whole) + 1))
                        << integrator << ' ' << shading << ", pixel " << i;
                    EXPECT_NEAR(component("light_sky") + component("light_lamp") + component("light_rest"),
                                whole, 1e-5 * (std::abs(whole) + 1))
                        << integrator << ' ' << shading << ", pixel " << i;
                }
        }
}

TEST(LightFilm, DoesNotChangeTheImageNorTheWork) {
    const std::string text = room(kSky + kLamp + kPoint);
    for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
        BuildOptions options = with(integrator);
        if (std::string(integrator).find("cache") != std::string::npos)
            options.defines = {"cache-mb=64"};
        const LightLayers without = renderLight(text, options, {}, 0, 1),
                          split = renderLight(text, options, kAll, 0, 1);
        EXPECT_EQ(0, std::memcmp(without.film.image().pixels.data(), split.film.image().pixels.data(),
                                 without.film.image().pixels.size() * sizeof(Rgb)))
            << integrator;
        EXPECT_EQ(without.stats.total.rays(), split.stats.total.rays()) << integrator;
        EXPECT_EQ(without.stats.total.shades, split.stats.total.shades) << integrator;
    }
}

TEST(LightFilm, DoesNotDependOnThreadsAndTiles) {
    const std::string text = room(kSky + kLamp + kPoint);
    for (const char* integrator : {"supersample", "msaa-cache", "indirect-cache"})
        EXPECT_TRUE(renderLight(text, with(integrator), kAll, 0, 1, 30).layers ==
                    renderLight(text, with(integrator), kAll, 0, 3, 5).layers)
            << integrator;
}

TEST(LightFilm, CacheSizeDoesNotChangeComponents) {
    const std::string text = room(kSky + kLamp + kPoint);
    BuildOptions small = with("msaa-cache");
    small.defines = {"cache-mb=0.001"};
    EXPECT_TRUE(renderLight(text, with("msaa-cache"), kAll).layers == renderLight(text, small, kAll).layers);
}

/// Per channel, the mean of all pixels over seeds, and its standard error.
using Means = std::array<test::Estimate, 3>;

/// `meanOfSeed` returns the mean of all pixels per channel.
template <class MeanOfSeed>
Means meansOver(int seeds, const MeanOfSeed& meanOfSeed) {
    double sum[3] = {}, sum2[3] = {};
    for (int s = 0; s < seeds; ++s) {
        const std::array<double, 3> mean = meanOfSeed(uint64_t(s));
        for (size_t c = 0; c < 3; ++c) {
            sum[c] += mean[c];
            sum2[c] += mean[c] * mean[c];
        }
    }
    Means means;
    for (size_t c = 0; c < 3; ++c) {
        const double mean = sum[c] / seeds;
        means[c] = {mean, std::sqrt(std::max(0.0, sum2[c] / seeds - mean * mean) / (seeds - 1))};
    }
    return means;
}

Means meansOfImage(const std::string& text, const BuildOptions& options, int seeds) {
    return meansOver(seeds, [&](uint64_t seed) {
        const LightLayers rendered = renderLight(text, options, {}, seed);
        std::array<double, 3> mean{};
        for (const Rgb& pixel : rendered.film.image().pixels)
            for (int c = 0; c < 3; ++c)
                mean[size_t(c)] += pixel[c] / double(rendered.film.image().pixels.size());
        return mean;
    });
}

Means meansOfLayer(const std::string& text, const BuildOptions& options, Aov aov, const std::string& layer,
                   int seeds) {
    return meansOver(seeds, [&](uint64_t seed) {
        const LightLayers rendered = renderLight(text, options, {aov}, seed + 1000);
        std::array<double, 3> mean{};
        for (size_t c = 0; c < 3; ++c)
            for (const float v : rendered.layers.at(layer + '.' + "RGB"[c]))
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

TEST(LightFilm, LightGroupsEqualRendersOfTheirLightsAlone) {
    constexpr int kSeeds = 12;
    const std::string all = room(kSky + kLamp + kPoint);
    for (const auto& [layer, lights] : {std::pair("light_sky", kSky), std::pair("light_rest", kPoint)})
        expectEqual(meansOfLayer(all, with("supersample"), Aov::LightGroups, layer, kSeeds),
                    meansOfImage(room(lights + kDarkLamp), with("supersample"), kSeeds), kSeeds, layer);
}

TEST(LightFilm, DirectEqualsTheDirectLightingShader) {
    constexpr int kSeeds = 12;
    const std::string text = room(kSky + kLamp + kPoint);
    BuildOptions path = with("supersample", "path"), direct = with("supersample", "directlighting");
    path.defines = direct.defines = {"maxdepth=12"}; // mirrors and glass differ slightly
    expectEqual(meansOfLayer(text, path, Aov::Direct, "direct", kSeeds), meansOfImage(text, direct, kSeeds),
                kSeeds, "direct");
    // The shader directlighting has no indirect light.
    const LightLayers rendered = renderLight(text, direct, {Aov::Indirect});
    EXPECT_EQ(rendered.layers.size(), 3u) << "only the requested layers";
    for (const float v : rendered.layers.at("indirect.R"))
        EXPECT_EQ(v, 0);
}

TEST(LightFilm, ErrorForCachesWithoutComponents) {
    BuildOptions options = with("msaa-cache");
    options.defines = {"scope=thread"};
    try {
        renderLight(room(kSky), options, kAll);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind, ErrorKind::Usage);
        EXPECT_STREQ(e.what(),
                     "scope thread, mutex and tile do not support layers of direct light, indirect light "
                     "and light groups: use scope shared or another integrator");
    }
}

TEST(LightFilm, ErrorForInvalidGroupNames) {
    try {
        test::build(room(R"(LightSource "infinite" "string group" "key light")"));
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(),
                     "\"group\" must consist of letters, digits and underscores, not \"key light\"");
    }
}

} // namespace
} // namespace strobe
