// Layers of what samples see, against scenes in which that is known.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <map>

namespace strobe {
namespace {

using F = Aov;

/// Channels by name.
using Layers = std::map<std::string, std::vector<float>>;

struct Seen {
    Layers layers;
    Film film;
    RenderStats stats;
    Metadata metadata;
};

Seen see(const std::string& text, std::vector<Aov> features, const BuildOptions& options = {},
         int threads = 2, int levels = 6) {
    const BuiltScene built = test::build(text, options);
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.threads = threads, settings.tileSize = 5;
    AovFilm gathered(*built.scene, *built.sampler.sampler, built.pixelBounds,
                     {features, built.cryptomatteMaterialNames, levels});
    settings.aovs = features.empty() ? nullptr : &gathered;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                               *built.filter, settings, film);
    Layers layers;
    for (AovChannel& channel : gathered.channels())
        layers[channel.layer + '.' + channel.name] = std::move(channel.values);
    return {std::move(layers), std::move(film), std::move(stats), gathered.metadata()};
}

std::string head(int width, int height, int spp, const std::string& more = "") {
    return "TransformTimes 0 1\nFilm \"image\" \"integer xresolution\" " + std::to_string(width) +
           " \"integer yresolution\" " + std::to_string(height) +
           "\nSampler \"independent\" \"integer pixelsamples\" " + std::to_string(spp) +
           "\nIntegrator \"directlighting\"\n" + more;
}

/// One unit is one pixel; y = 0 is the frame's lower edge.
std::string flat(int width, int height) {
    return "Camera \"orthographic\" \"float screenwindow\" [0 " + std::to_string(width) + " 0 " +
           std::to_string(height) + "]\nWorldBegin\nLightSource \"infinite\"\n";
}

/// A rectangle that faces the camera, at distance z.
std::string quad(float x0, float x1, float y0, float y1, float z, const std::string& more = "") {
    const auto point = [&](float x, float y) {
        return std::to_string(x) + ' ' + std::to_string(y) + ' ' + std::to_string(z) + ' ';
    };
    return "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point2 uv\" [0 0 1 0 1 1 0 1] \"point "
           "P\" [" +
           point(x0, y0) + point(x1, y0) + point(x1, y1) + point(x0, y1) + "] " + more + "\n";
}

std::string moving(const std::string& what, const std::string& translation) {
    return "AttributeBegin\nActiveTransform EndTime\nTranslate " + translation + "\nActiveTransform All\n" +
           what + "AttributeEnd\n";
}

float idOf(const std::string& name) { return std::bit_cast<float>(cryptomatteId(name)); }

/// What a Cryptomatte layer says that `name` covers of a pixel.
float coverage(const Layers& layers, const std::string& layer, const std::string& name, size_t at) {
    float sum = 0;
    for (const char* rank : {"00", "01", "02"})
        for (const char* pair : {"RG", "BA"})
            if (const std::string start = layer + rank + '.'; layers.at(start + pair[0])[at] == idOf(name))
                sum += layers.at(start + pair[1])[at];
    return sum;
}

/// The part of pixel x (of width 1) and of the shutter in which a wall from x0 to infinity, moving right by
/// v, covers it.
double wallCoverage(double x, double x0, double v) {
    const auto integral = [&](double s) {
        const double past = std::clamp(s - x0, 0.0, v);
        return past * past / (2 * v) + std::max(s - x0 - v, 0.0);
    };
    return integral(x + 1) - integral(x);
}

TEST(CryptomatteLayer, CoverageIsTheBlurOfAMovingQuad) {
    constexpr int kWidth = 24, kSpp = 4096;
    constexpr double kLeft = 5.3, kRight = 8.6, kWay = 9.7;
    const std::string text = head(kWidth, 1, kSpp) + flat(kWidth, 1) +
                             quad(-5, 99, -5, 5, 9, "\"string name\" \"wall\"") +
                             moving(quad(kLeft, kRight, -5, 5, 5, "\"string name\" \"quad\""), "9.7 0 0");
    const double z = test::criticalZ(kWidth, 1000);
    Layers first;
    for (const char* integrator : {"supersample", "msaa", "msaa-cache", "indirect-cache"}) {
        BuildOptions options;
        options.integrator = integrator;
        const Layers layers = see(text, {F::CryptoObject}, options).layers;
        for (int x = 0; x < kWidth; ++x) {
            const double expected = wallCoverage(x, kLeft, kWay) - wallCoverage(x, kRight, kWay);
            const double error = std::sqrt(expected * (1 - expected) / kSpp) + 1e-6;
            const float quad = coverage(layers, "CryptoObject", "quad", size_t(x));
            EXPECT_NEAR(quad, expected, z * error) << integrator << ", pixel " << x;
            EXPECT_FLOAT_EQ(quad + coverage(layers, "CryptoObject", "wall", size_t(x)), 1) << x;
        }
        if (first.empty())
            first = layers;
        EXPECT_TRUE(first == layers) << "it is about visibility alone";
    }
}

TEST(CryptomatteLayer, CoverageIsThatOfThePixelFilter) {
    // An edge in the middle of a pixel, seen through filters with and without negative parts: the coverage of
    // the pixel beside is the part of the filter's absolute value that reaches over the edge.
    constexpr int kSpp = 16384;
    const std::string world = flat(8, 1) + quad(4.5, 99, -9, 9, 5, "\"string name\" \"right\"");
    const auto rightOf = [&](const std::string& filter, size_t x) {
        return double(coverage(see(head(8, 1, kSpp, filter) + world, {F::CryptoObject}).layers,
                               "CryptoObject", "right", x));
    };
    // A triangle of radius 2: a quarter of a unit's mean beyond its half: (1 - 1/2)² / 2.
    EXPECT_NEAR(rightOf("PixelFilter \"triangle\" \"float xwidth\" 2 \"float ywidth\" 2\n", 3), 0.125, 0.01);
    EXPECT_NEAR(rightOf("PixelFilter \"triangle\" \"float xwidth\" 2 \"float ywidth\" 2\n", 4), 0.5, 0.015);
    const double mitchell = rightOf("PixelFilter \"mitchell\"\n", 3);
    EXPECT_GT(mitchell, 0.01);
    EXPECT_LT(mitchell, 0.5);
}

TEST(CryptomatteLayer, NamesComeFromTheScene) {
    const std::string ball = "Shape \"sphere\"\n";
    const std::string text = head(4, 4, 1) + flat(4, 4) + ball +
                             "MakeNamedMaterial \"gold\" \"string type\" \"metal\"\nNamedMaterial \"gold\"\n"
                             "ObjectBegin \"leaf\"\n" +
                             ball +
                             "ObjectEnd\nObjectBegin \"tree\"\nObjectInstance \"leaf\"\nObjectInstance "
                             "\"leaf\"\nShape \"sphere\" \"string name\" \"trunk\"\nObjectEnd\n"
                             "ObjectInstance \"tree\"\nObjectInstance \"tree\"\n"
                             "Material \"mirror\"\n" +
                             ball + "Material \"mirror\"\nAttribute \"shape\" \"string name\" \"pair\"\n" +
                             ball + ball;
    const Seen seen = see(text, {F::CryptoObject, F::CryptoMaterial});
    std::map<std::string, std::string> metadata;
    for (const auto& [key, value] : seen.metadata)
        metadata[key] = std::get<std::string>(value);
    const auto keys = [](const std::string& manifest) { // every second string between quotes
        std::vector<std::string> words;
        for (size_t at = 0, end; (at = manifest.find('"', at)) != std::string::npos; at = end + 1) {
            end = manifest.find('"', at + 1);
            words.push_back(manifest.substr(at + 1, end - at - 1));
        }
        std::vector<std::string> names;
        for (size_t i = 0; i < words.size(); i += 2)
            names.push_back(words[i]);
        return names;
    };
    EXPECT_EQ(keys(metadata["cryptomatte/3ae39a5/manifest"]),
              (std::vector<std::string>{"pair", "sphere#1", "sphere#2", "tree#1/leaf#1", "tree#1/leaf#2",
                                        "tree#1/trunk", "tree#2/leaf#1", "tree#2/leaf#2", "tree#2/trunk"}));
    EXPECT_EQ(keys(metadata["cryptomatte/be359d6/manifest"]),
              (std::vector<std::string>{"default", "gold", "mirror#1", "mirror#2"}));
    EXPECT_EQ(metadata["cryptomatte/3ae39a5/name"], "CryptoObject");
}

TEST(CryptomatteLayer, HasAsManyRanksAsAskedFor) {
    std::string text = head(1, 1, 4096) + flat(1, 1);
    for (int i = 0; i < 8; ++i) // strips of different widths
        text += quad(float(i * i) / 64, float((i + 1) * (i + 1)) / 64, -1, 2, 5,
                     "\"string name\" \"strip" + std::to_string(i) + "\"");
    for (const int levels : {1, 2, 6, 16}) {
        const Layers layers = see(text, {F::CryptoObject}, {}, 1, levels).layers;
        EXPECT_EQ(layers.size(), size_t(levels + 1) / 2 * 4) << levels;
        EXPECT_EQ(layers.at("CryptoObject00.R")[0], idOf("strip7"));
        EXPECT_NEAR(layers.at("CryptoObject00.G")[0], 15. / 64, 0.04);
        float before = 1;
        for (const auto& [name, values] : layers) {
            if (name.back() != 'G')
                continue;
            EXPECT_LE(values[0], before);
            before = values[0];
        }
    }
}

TEST(Features, AreWhatIsThere) {
    // A wall in the left half; the right half is empty.
    const std::string text =
        head(8, 4, 16) + flat(8, 4) + "Material \"matte\" \"rgb Kd\" [.2 .4 .6]\n" + quad(0, 4, 0, 4, 5);
    const Layers l = see(text, {F::Normal, F::Albedo, F::Depth, F::Position, F::Uv, F::MotionVector,
                                F::ObjectId, F::MaterialId, F::PrimitiveId})
                         .layers;
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
            EXPECT_EQ(l.at("materialid.Y")[i], wall ? 2 : 0) << "the first is the default";
            const float u = l.at("uv.U")[i], v = l.at("uv.V")[i];
            EXPECT_EQ(l.at("primitiveid.Y")[i], !wall ? 0 : u > v ? 1 : 2);
        }
}

TEST(Features, OfOneSampleAreOfTheSameNearTheMiddle) {
    const Layers l = see(head(8, 4, 64) + flat(8, 4) + quad(0, 8, 0, 4, 5), {F::Position}).layers;
    double sum = 0;
    for (size_t i = 0; i < 32; ++i)
        sum += std::hypot(l.at("position.X")[i] - double(i % 8) - .5,
                          l.at("position.Y")[i] - 3.5 + double(i / 8));
    EXPECT_LT(sum / 32, 0.1) << "of 64 samples, the nearest is about 1 / (2 sqrt(64)) away";
}

TEST(Features, MeansAreSmoothAtEdges) {
    const Layers l = see(head(8, 1, 1024) + flat(8, 1) + "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n" +
                             quad(0, 3.25, 0, 4, 5),
                         {F::Normal, F::Albedo})
                         .layers;
    EXPECT_NEAR(l.at("normal.Z")[3], -0.25, 0.06);
    EXPECT_NEAR(l.at("albedo.R")[3], 0.125, 0.03);
}

TEST(Features, MotionIsInPixelsRightAndUp) {
    const std::string text = head(16, 8, 64) + flat(16, 8);
    const auto at = [](const Layers& l, size_t i) {
        return V2f(l.at("motionvector.X")[i], l.at("motionvector.Y")[i]);
    };
    const size_t middle = 4 * 16 + 8;
    const Layers shape =
        see(text + quad(-90, 90, -90, 90, 9) + moving(quad(6, 11, 2, 6, 5), "1.5 .75 0"), {F::MotionVector})
            .layers;
    EXPECT_NEAR((at(shape, middle) - V2f(1.5, .75)).length(), 0, 1e-4);
    EXPECT_EQ(at(shape, 0), V2f(0)) << "the wall behind rests";
    const std::string object = "ObjectBegin \"o\"\n" + quad(6, 11, 2, 6, 5) + "ObjectEnd\n";
    const Layers instance =
        see(text + object + moving("ObjectInstance \"o\"\n", "1.5 .75 0"), {F::MotionVector}).layers;
    EXPECT_NEAR((at(instance, middle) - V2f(1.5, .75)).length(), 0, 1e-4);
    // A camera that moves to the left lets everything seem to move to the right.
    const Layers camera =
        see(head(16, 8, 64) + "ActiveTransform EndTime\nTranslate 2 0 0\nActiveTransform All\n" +
                flat(16, 8) + quad(-90, 90, -90, 90, 9),
            {F::MotionVector})
            .layers;
    EXPECT_NEAR((at(camera, middle) - V2f(2, 0)).length(), 0, 1e-4);
}

TEST(Features, MotionSeesPerspective) {
    // At distance 4 a pixel of a 90 degrees camera with 8 rows is one unit high.
    const std::string text =
        head(16, 8, 64) + "Camera \"perspective\" \"float fov\" 90\nWorldBegin\nLightSource \"infinite\"\n" +
        moving(quad(-90, 90, -90, 90, 4), "0 0 4");
    const Layers l = see(text, {F::MotionVector}).layers;
    for (size_t i = 0; i < 16 * 8; ++i) {
        // What goes twice as far away is seen half as far from the middle: of what is in the pixel at some
        // time t, at 4 + 4t, it was (1 + t) as far from the middle when the shutter opened, and ends at half
        // of that.
        const V2f place(float(i % 16) - 7.5f, 3.5f - float(i / 16));
        const V2f way(l.at("motionvector.X")[i], l.at("motionvector.Y")[i]);
        EXPECT_LT(way.dot(place), 0);
        EXPECT_GT(way.length(), place.length() * .5f - .5f);
        EXPECT_LT(way.length(), place.length() + .5f);
    }
}

TEST(Features, AlbedosAreWhatComesBackOfWhiteLight) {
    // A furnace: in white light from all around, a surface looks as its albedo, if it has no neighbors.
    for (const char* material : {"\"matte\" \"rgb Kd\" [.2 .5 .8]", "\"mirror\" \"rgb Kr\" [.3 .6 .9]",
                                 "\"metal\" \"float roughness\" .1", "\"plastic\" \"rgb Kd\" [.4 .2 .1]"}) {
        const std::string text =
            head(12, 12, 256) +
            "LookAt 0 0 -3 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\n"
            "LightSource \"infinite\"\nMaterial " +
            material + "\nShape \"sphere\"\n";
        const Seen seen = see(text, {F::Albedo, F::Normal});
        double albedo[3] = {}, beauty[3] = {};
        for (size_t y = 4; y < 8; ++y)
            for (size_t x = 4; x < 8; ++x)
                for (size_t c = 0; c < 3; ++c) {
                    albedo[c] += seen.layers.at(std::string("albedo.") + "RGB"[c])[12 * y + x] / 16;
                    beauty[c] += seen.film.image().pixels[12 * y + x][int(c)] / 16;
                }
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(albedo[c], beauty[c], 0.01) << material << ", channel " << c;
    }
}

TEST(Features, CostNothingUnlessAskedFor) {
    const std::string text = head(8, 8, 16) + flat(8, 8) + quad(0, 8, 0, 8, 5);
    constexpr uint64_t kPixels = 64, kSamples = 64 * 16;
    EXPECT_EQ(see(text, {}).stats.total.surfaces, kSamples) << "those that are shaded";
    EXPECT_EQ(see(text, {F::Depth, F::MotionVector, F::ObjectId, F::MaterialId, F::PrimitiveId,
                         F::CryptoObject, F::CryptoMaterial})
                  .stats.total.surfaces,
              kSamples)
        << "nothing of this needs the surface";
    const uint64_t ofOne = see(text, {F::Position, F::Uv}, {}, 1).stats.total.surfaces;
    EXPECT_EQ(ofOne, kSamples + kPixels) << "that of one sample each";
    EXPECT_EQ(see(text, {F::Normal, F::Albedo}).stats.total.surfaces, 2 * kSamples);
    EXPECT_EQ(see(text, {F::Normal, F::Albedo}).stats.total.footprints, 0u);
}

TEST(Features, DoNotDependOnThreadsNorChangeThePicture) {
    const std::string text =
        head(16, 8, 16) + flat(16, 8) + quad(-90, 90, -90, 90, 9) + moving(quad(6, 11, 2, 6, 5), "1.5 .75 0");
    const std::vector<Aov> all = {F::Normal, F::Albedo,   F::Position,     F::MotionVector,
                                  F::Uv,     F::ObjectId, F::CryptoObject, F::CryptoMaterial};
    const Seen none = see(text, {}), one = see(text, all, {}, 1), three = see(text, all, {}, 3);
    EXPECT_TRUE(one.layers == three.layers);
    EXPECT_EQ(0, std::memcmp(none.film.image().pixels.data(), three.film.image().pixels.data(),
                             none.film.image().pixels.size() * sizeof(Rgb)));
}

} // namespace
} // namespace strobe
