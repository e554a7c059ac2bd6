// The image has the same bits for any number of threads, tile size and crop.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

bool sameBits(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height &&
           !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

/// Motion, depth of field, textures, glossy and specular materials, an area light.
const std::string kScene = R"(
    TransformTimes 0 .5 1
    Film "image" "integer xresolution" 75 "integer yresolution" 53
    PixelFilter "sinc"
    Sampler "sobol" "integer pixelsamples" 8
    Integrator "path"
    LookAt 0 2 -6  0 .5 0  0 1 0
    Camera "perspective" "float fov" 50 "float lensradius" .05 "float focaldistance" 6
    WorldBegin
    LightSource "infinite" "rgb L" [.3 .4 .5]
    AttributeBegin
      Translate 2 4 -2
      AreaLightSource "diffuse" "rgb L" [20 20 20] "integer nsamples" 3
      Shape "sphere" "float radius" .5
    AttributeEnd
    Texture "c" "rgb" "checkerboard" "rgb tex1" [.2 .2 .2] "rgb tex2" [.9 .8 .7]
    Material "matte" "texture Kd" "c"
    Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
      "point2 uv" [0 0  8 0  8 8  0 8]
    AttributeBegin
      Material "plastic" "float roughness" .05
      Translate -1 1 0
      ActiveTransform 1
      Rotate 90 0 0 1
      ActiveTransform 2
      Translate .5 0 0
      Rotate 200 0 0 1
      ActiveTransform All
      Scale 1 .5 1
      Shape "sphere" "float radius" .9
    AttributeEnd
    AttributeBegin
      Material "glass"
      Translate 1.2 1 -1
      Shape "sphere" "float radius" .7
    AttributeEnd
)";

TEST(Identity, ImagesDoNotDependOnThreadsTilesAndCrops) {
    const BuiltScene built = test::build(kScene);
    const Image reference = test::render(built, 5, 1, 16).image;
    EXPECT_EQ(test::render(built, 5, 1, 16).stats.total.invalidSamples, 0u);
    for (int threads : {2, 7})
        EXPECT_TRUE(sameBits(reference, test::render(built, 5, threads, 16).image)) << threads;
    for (int tile : {1, 8, 13, 64, 256})
        EXPECT_TRUE(sameBits(reference, test::render(built, 5, 2, tile).image)) << tile;
    EXPECT_FALSE(sameBits(reference, test::render(built, 6, 2, 16).image))
        << "another seed gives another image";

    BuildOptions options;
    options.crop = {.21f, .77f, .1f, .63f};
    const BuiltScene cropped = test::build(kScene, options);
    const Image crop = test::render(cropped, 5).image;
    const PixelBounds bounds = cropped.pixelBounds;
    EXPECT_EQ(crop.width, bounds.width());
    for (int y = bounds.y0; y < bounds.y1; ++y)
        EXPECT_EQ(0, std::memcmp(&crop.at(0, y - bounds.y0), &reference.at(bounds.x0, y),
                                 sizeof(Rgb) * size_t(bounds.width())));
}

TEST(Identity, AdjacentCropsCoverEachPixelOnce) {
    int pixels = 0;
    for (int i = 0; i < 7; ++i) {
        BuildOptions options;
        options.crop = {float(i) / 7, float(i + 1) / 7, 0, 1};
        pixels += test::build(kScene, options).pixelBounds.width();
    }
    EXPECT_EQ(pixels, 75);
}

} // namespace
} // namespace strobe
