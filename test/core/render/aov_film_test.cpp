// AOVs of the visible surfaces, in scenes where their values are known.
#include "support/render_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <map>

namespace strobe {
namespace {

using F = Aov;

/// Channels by name.
using Layers = std::map<std::string, std::vector<float>>;

struct Rendered {
    Layers layers;
    Film film;
    RenderStats stats;
    Metadata metadata;
};

Rendered renderAovs(const std::string& text, const std::vector<Aov>& aovs, const BuildOptions& options = {},
                    int threads = 2, int levels = 6) {
    const BuiltScene built = test::build(text, options);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.threads = threads;
    settings.tileSize = 5;
    AovFilm aovFilm(*built.scene, *built.sampler.sampler, built.pixelBounds,
                    {aovs, built.cryptomatteMaterialNames, levels});
    settings.aovs = aovs.empty() ? nullptr : &aovFilm;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                               *built.filter, settings, film);
    Layers layers;
    for (AovChannel& channel : aovFilm.sums().channels())
        layers[channel.layer + '.' + channel.name] = std::move(channel.values);
    return {std::move(layers), std::move(film), std::move(stats), aovFilm.sums().metadata()};
}

Layers layersOf(const std::string& text, const std::vector<Aov>& aovs, const BuildOptions& options = {}) {
    return renderAovs(text, aovs, options).layers;
}

std::string head(int width, int height, int samplesPerPixel) {
    return fmt::format(R"(
        TransformTimes 0 1
        Film "image" "integer xresolution" {} "integer yresolution" {}
        Sampler "independent" "integer pixelsamples" {}
        Integrator "directlighting"
        )",
                       width, height, samplesPerPixel);
}

/// An orthographic camera, for which one unit is one pixel and y = 0 is the lower edge of the frame.
std::string orthographic(int width, int height) {
    return fmt::format(R"(
        Camera "orthographic" "float screenwindow" [0 {} 0 {}]
        WorldBegin
        LightSource "infinite"
        )",
                       width, height);
}

/// A rectangle that faces the camera, at distance z.
std::string quad(float x0, float x1, float y0, float y1, float z, const std::string& name = "") {
    return fmt::format(R"(
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point2 uv" [0 0  1 0  1 1  0 1]
          "point P" [{0} {2} {4}  {1} {2} {4}  {1} {3} {4}  {0} {3} {4}] {5}
        )",
                       x0, x1, y0, y1, z, name.empty() ? "" : fmt::format("\"string name\" \"{}\"", name));
}

std::string moving(const std::string& shape, const std::string& translation) {
    return "AttributeBegin\nActiveTransform EndTime\nTranslate " + translation + "\nActiveTransform All\n" +
           shape + "AttributeEnd\n";
}

float idOf(const std::string& name) { return std::bit_cast<float>(cryptomatteId(name)); }

/// Returns the coverage of a pixel by `name` in a Cryptomatte layer.
float coverage(const Layers& layers, const std::string& layer, const std::string& name, size_t pixel) {
    float sum = 0;
    for (const char* rank : {"00", "01", "02"})
        for (const char* pair : {"RG", "BA"})
            if (const std::string prefix = layer + rank + '.';
                layers.at(prefix + pair[0])[pixel] == idOf(name))
                sum += layers.at(prefix + pair[1])[pixel];
    return sum;
}

/// Returns the coverage, over the shutter, of pixel x (of width 1) by a wall from x0 to infinity that moves
/// right by v.
double wallCoverage(double x, double x0, double v) {
    const auto integral = [&](double s) {
        const double distance = std::clamp(s - x0, 0.0, v);
        return distance * distance / (2 * v) + std::max(s - x0 - v, 0.0);
    };
    return integral(x + 1) - integral(x);
}

TEST(CryptomatteAov, CoverageEqualsTheMotionBlur) {
    constexpr int kWidth = 24, kSpp = 4096;
    constexpr double kLeft = 5.3, kRight = 8.6, kDistance = 9.7;
    const std::string text = head(kWidth, 1, kSpp) + orthographic(kWidth, 1) +
                             quad(-5, 99, -5, 5, 9, "wall") +
                             moving(quad(kLeft, kRight, -5, 5, 5, "quad"), "9.7 0 0");
    const double z = test::criticalZ(kWidth, 1000);
    Layers first;
    for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
        BuildOptions options;
        options.integrator = integrator;
        const Layers layers = layersOf(text, {F::CryptoObject}, options);
        for (int x = 0; x < kWidth; ++x) {
            const double expected = wallCoverage(x, kLeft, kDistance) - wallCoverage(x, kRight, kDistance);
            const double error = std::sqrt(expected * (1 - expected) / kSpp) + 1e-6;
            const float quad = coverage(layers, "CryptoObject", "quad", size_t(x));
            EXPECT_NEAR(quad, expected, z * error) << integrator << ", pixel " << x;
            EXPECT_FLOAT_EQ(quad + coverage(layers, "CryptoObject", "wall", size_t(x)), 1) << x;
        }
        if (first.empty())
            first = layers;
        EXPECT_TRUE(first == layers) << "Cryptomatte does not depend on the integrator";
    }
}

TEST(CryptomatteAov, CoverageIsFiltered) {
    // An edge in the middle of a pixel, with filters with and without negative lobes. The coverage is
    // weighted by the absolute value of the filter.
    constexpr int kSpp = 16384;
    const auto coverageOf = [&](const std::string& filter, size_t pixel) {
        const std::string text =
            head(8, 1, kSpp) + filter + orthographic(8, 1) + quad(4.5, 99, -9, 9, 5, "right");
        return double(coverage(layersOf(text, {F::CryptoObject}), "CryptoObject", "right", pixel));
    };
    // The fraction of a triangle filter of radius 2 behind half of its radius is (1 - 1/2)² / 2.
    const std::string triangle = R"(PixelFilter "triangle" "float xwidth" 2 "float ywidth" 2)";
    EXPECT_NEAR(coverageOf(triangle, 3), 0.125, 0.01);
    EXPECT_NEAR(coverageOf(triangle, 4), 0.5, 0.015);
    const double mitchell = coverageOf(R"(PixelFilter "mitchell")", 3);
    EXPECT_GT(mitchell, 0.01);
    EXPECT_LT(mitchell, 0.5);
}

/// Returns the names in a Cryptomatte manifest: every second string between quotes.
std::vector<std::string> namesIn(const std::string& manifest) {
    std::vector<std::string> names;
    size_t count = 0;
    for (size_t begin = 0, end; (begin = manifest.find('"', begin)) != std::string::npos; begin = end + 1) {
        end = manifest.find('"', begin + 1);
        if (count++ % 2 == 0)
            names.push_back(manifest.substr(begin + 1, end - begin - 1));
    }
    return names;
}

TEST(CryptomatteAov, ManifestsHaveTheNamesOfTheScene) {
    const std::string text = head(4, 4, 1) + orthographic(4, 4) + R"(
        Shape "sphere"
        MakeNamedMaterial "gold" "string type" "metal"
        NamedMaterial "gold"
        ObjectBegin "leaf"
          Shape "sphere"
        ObjectEnd
        ObjectBegin "tree"
          ObjectInstance "leaf"
          ObjectInstance "leaf"
          Shape "sphere" "string name" "trunk"
        ObjectEnd
        ObjectInstance "tree"
        ObjectInstance "tree"
        Material "mirror"
        Shape "sphere"
        Material "mirror"
        Attribute "shape" "string name" "pair"
        Shape "sphere"
        Shape "sphere"
        )";
    const Rendered rendered = renderAovs(text, {F::CryptoObject, F::CryptoMaterial});
    std::map<std::string, std::string> metadata;
    for (const auto& [key, value] : rendered.metadata)
        metadata[key] = std::get<std::string>(value);
    EXPECT_EQ(namesIn(metadata["cryptomatte/3ae39a5/manifest"]),
              (std::vector<std::string>{"pair", "sphere#1", "sphere#2", "tree#1/leaf#1", "tree#1/leaf#2",
                                        "tree#1/trunk", "tree#2/leaf#1", "tree#2/leaf#2", "tree#2/trunk"}));
    EXPECT_EQ(namesIn(metadata["cryptomatte/be359d6/manifest"]),
              (std::vector<std::string>{"default", "gold", "mirror#1", "mirror#2"}));
    EXPECT_EQ(metadata["cryptomatte/3ae39a5/name"], "CryptoObject");
}

TEST(CryptomatteAov, HasTheRequestedNumberOfLevels) {
    std::string text = head(1, 1, 4096) + orthographic(1, 1);
    for (int i = 0; i < 8; ++i) // strips of increasing width
        text += quad(float(i * i) / 64, float((i + 1) * (i + 1)) / 64, -1, 2, 5, "strip" + std::to_string(i));
    for (const int levels : {1, 2, 6, 16}) {
        const Layers layers = renderAovs(text, {F::CryptoObject}, {}, 1, levels).layers;
        EXPECT_EQ(layers.size(), size_t(levels + 1) / 2 * 4) << levels;
        EXPECT_EQ(layers.at("CryptoObject00.R")[0], idOf("strip7"));
        EXPECT_NEAR(layers.at("CryptoObject00.G")[0], 15. / 64, 0.04);
        float previous = 1;
        for (const auto& [name, values] : layers) {
            if (name.back() != 'G')
                continue;
            EXPECT_LE(values[0], previous);
            previous = values[0];
        }
    }
}

TEST(AovFilm, ValuesAreThoseOfTheSurfaces) {
    // A wall in the left half; the right half is background.
    const std::string text = head(8, 4, 16) + orthographic(8, 4) + R"(
        Material "matte" "rgb Kd" [.2 .4 .6]
        )" + quad(0, 4, 0, 4, 5);
    const Layers l = layersOf(text, {F::Normal, F::Albedo, F::Depth, F::Position, F::Uv, F::MotionVector,
                                     F::ObjectId, F::MaterialId, F::PrimitiveId});
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x) {
            const size_t i = size_t(8 * y + x);
            const bool wall = x < 4;
            EXPECT_NEAR(l.at("normal.Z")[i], wall ? -1 : 0, 1e-6) << "towards the camera";
            EXPECT_NEAR(l.at("albedo.R")[i], wall ? .2 : 0, 1e-6);
            EXPECT_NEAR(l.at("albedo.G")[i], wall ? .4 : 0, 1e-6);
            EXPECT_NEAR(l.at("albedo.B")[i], wall ? .6 : 0, 1e-6);
            EXPECT_NEAR(l.at("depth.Z")[i], wall ? 5 : 1e10, 1e-5);
            EXPECT_NEAR(l.at("position.X")[i], wall ? x + .5 : 0, 0.5);
            EXPECT_NEAR(l.at("position.Y")[i], wall ? 3.5 - y : 0, 0.5);
            EXPECT_NEAR(l.at("uv.U")[i], wall ? l.at("position.X")[i] / 4 : 0, 1e-6);
            EXPECT_NEAR(l.at("uv.V")[i], wall ? l.at("position.Y")[i] / 4 : 0, 1e-6);
            EXPECT_EQ(l.at("motionvector.X")[i], 0);
            EXPECT_EQ(l.at("objectid.Y")[i], wall ? 1 : 0);
            EXPECT_EQ(l.at("materialid.Y")[i], wall ? 2 : 0) << "material 1 is the default";
            const float u = l.at("uv.U")[i], v = l.at("uv.V")[i];
            EXPECT_EQ(l.at("primitiveid.Y")[i], !wall ? 0 : u > v ? 1 : 2);
        }
}

TEST(AovFilm, ValuesOfOneSampleAreOfTheNearestToThePixelCenter) {
    const Layers l = layersOf(head(8, 4, 64) + orthographic(8, 4) + quad(0, 8, 0, 4, 5), {F::Position});
    double sum = 0;
    for (size_t i = 0; i < 32; ++i)
        sum += std::hypot(l.at("position.X")[i] - double(i % 8) - .5,
                          l.at("position.Y")[i] - 3.5 + double(i / 8));
    EXPECT_LT(sum / 32, 0.1) << "the expected distance of the nearest of 64 samples is 1 / (2 sqrt(64))";
}

TEST(AovFilm, MeansAreAntialiased) {
    const std::string text = head(8, 1, 1024) + orthographic(8, 1) + R"(
        Material "matte" "rgb Kd" [.5 .5 .5]
        )" + quad(0, 3.25, 0, 4, 5);
    const Layers l = layersOf(text, {F::Normal, F::Albedo});
    EXPECT_NEAR(l.at("normal.Z")[3], -0.25, 0.06);
    EXPECT_NEAR(l.at("albedo.R")[3], 0.125, 0.03);
}

V2f motionVector(const Layers& layers, size_t pixel) {
    return {layers.at("motionvector.X")[pixel], layers.at("motionvector.Y")[pixel]};
}

TEST(AovFilm, MotionVectorsAreInPixelsRightAndUp) {
    const std::string start = head(16, 8, 64) + orthographic(16, 8);
    const std::string background = quad(-90, 90, -90, 90, 9);
    const size_t center = 4 * 16 + 8;
    const Layers shape =
        layersOf(start + background + moving(quad(6, 11, 2, 6, 5), "1.5 .75 0"), {F::MotionVector});
    EXPECT_NEAR((motionVector(shape, center) - V2f(1.5, .75)).length(), 0, 1e-4);
    EXPECT_EQ(motionVector(shape, 0), V2f(0)) << "the background is static";
    const std::string object = "ObjectBegin \"o\"\n" + quad(6, 11, 2, 6, 5) + "ObjectEnd\n";
    const Layers instance =
        layersOf(start + object + moving("ObjectInstance \"o\"\n", "1.5 .75 0"), {F::MotionVector});
    EXPECT_NEAR((motionVector(instance, center) - V2f(1.5, .75)).length(), 0, 1e-4);
    // If the camera moves to the left, surfaces move to the right.
    const std::string cameraMotion = R"(
        ActiveTransform EndTime
        Translate 2 0 0
        ActiveTransform All
        )";
    const Layers camera =
        layersOf(head(16, 8, 64) + cameraMotion + orthographic(16, 8) + background, {F::MotionVector});
    EXPECT_NEAR((motionVector(camera, center) - V2f(2, 0)).length(), 0, 1e-4);
}

TEST(AovFilm, MotionVectorsIncludePerspective) {
    // At distance 4, a pixel of a camera with 90 degrees and 8 rows is one unit high.
    const std::string text = head(16, 8, 64) + R"(
        Camera "perspective" "float fov" 90
        WorldBegin
        LightSource "infinite"
        )" + moving(quad(-90, 90, -90, 90, 4), "0 0 4");
    const Layers l = layersOf(text, {F::MotionVector});
    for (size_t i = 0; i < 16 * 8; ++i) {
        // The wall moves from distance 4 to 8. A point seen at time t, at distance 4 + 4t, is (1 + t) times
        // as far from the image center at shutter open, and half as far as then at shutter close.
        const V2f position(float(i % 16) - 7.5f, 3.5f - float(i / 16));
        const V2f motion = motionVector(l, i);
        EXPECT_LT(motion.dot(position), 0);
        EXPECT_GT(motion.length(), position.length() * .5f - .5f);
        EXPECT_LT(motion.length(), position.length() + .5f);
    }
}

TEST(AovFilm, AlbedoEqualsTheRadianceInAWhiteFurnace) {
    for (const char* material : {R"("matte" "rgb Kd" [.2 .5 .8])", R"("mirror" "rgb Kr" [.3 .6 .9])",
                                 R"("metal" "float roughness" .1)", R"("plastic" "rgb Kd" [.4 .2 .1])"}) {
        const std::string text = head(12, 12, 256) + fmt::format(R"(
            LookAt 0 0 -3  0 0 0  0 1 0
            Camera "perspective" "float fov" 45
            WorldBegin
            LightSource "infinite"
            Material {}
            Shape "sphere"
            )",
                                                                 material);
        const Rendered rendered = renderAovs(text, {F::Albedo, F::Normal});
        double albedo[3] = {}, radiance[3] = {};
        for (size_t y = 4; y < 8; ++y)
            for (size_t x = 4; x < 8; ++x)
                for (size_t c = 0; c < 3; ++c) {
                    albedo[c] += rendered.layers.at(std::string("albedo.") + "RGB"[c])[12 * y + x] / 16;
                    radiance[c] += rendered.film.image().pixels[12 * y + x][int(c)] / 16;
                }
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(albedo[c], radiance[c], 0.01) << material << ", channel " << c;
    }
}

TEST(AovFilm, SurfacesAreEvaluatedOnlyIfNeeded) {
    const std::string text = head(8, 8, 16) + orthographic(8, 8) + quad(0, 8, 0, 8, 5);
    constexpr uint64_t kPixels = 64, kSamples = 64 * 16;
    const auto countersOf = [&](const std::vector<Aov>& aovs) {
        return renderAovs(text, aovs, {}, 1).stats.total;
    };
    EXPECT_EQ(countersOf({}).surfaces, kSamples) << "one per shade";
    EXPECT_EQ(countersOf({F::Depth, F::MotionVector, F::ObjectId, F::MaterialId, F::PrimitiveId,
                          F::CryptoObject, F::CryptoMaterial})
                  .surfaces,
              kSamples)
        << "none of these needs the surface";
    EXPECT_EQ(countersOf({F::Position, F::Uv}).surfaces, kSamples + kPixels) << "one more per pixel";
    EXPECT_EQ(countersOf({F::Normal, F::Albedo}).surfaces, 2 * kSamples);
    EXPECT_EQ(countersOf({F::Normal, F::Albedo}).footprints, 0u);
}

TEST(AovFilm, DoesNotDependOnThreadsNorChangeTheImage) {
    const std::string text = head(16, 8, 16) + orthographic(16, 8) + quad(-90, 90, -90, 90, 9) +
                             moving(quad(6, 11, 2, 6, 5), "1.5 .75 0");
    const std::vector<Aov> aovs = {F::Normal, F::Albedo,   F::Position,     F::MotionVector,
                                   F::Uv,     F::ObjectId, F::CryptoObject, F::CryptoMaterial};
    const Rendered none = renderAovs(text, {});
    const Rendered oneThread = renderAovs(text, aovs, {}, 1);
    const Rendered threeThreads = renderAovs(text, aovs, {}, 3);
    EXPECT_TRUE(oneThread.layers == threeThreads.layers);
    EXPECT_EQ(0, std::memcmp(none.film.image().pixels.data(), threeThreads.film.image().pixels.data(),
                             none.film.image().pixels.size() * sizeof(Rgb)));
}

} // namespace
} // namespace strobe
