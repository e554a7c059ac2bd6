// The same bits for any number of threads, tile size and crop.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe {
namespace {

bool sameBits(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height &&
           !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

const std::string kScene =
    "TransformTimes 0 .5 1\nFilm \"image\" \"integer xresolution\" 75 \"integer yresolution\" 53\n"
    "PixelFilter \"mitchell\"\nSampler \"sobol\" \"integer pixelsamples\" 8\nIntegrator \"path\"\n"
    "LookAt 0 2 -6 0 .5 0 0 1 0\nCamera \"perspective\" \"float fov\" 50 \"float lensradius\" .05 "
    "\"float "
    "focaldistance\" 6\n"
    "WorldBegin\nLightSource \"infinite\" \"rgb L\" [.3 .4 .5]\n"
    "AttributeBegin\nTranslate 2 4 -2\nAreaLightSource \"diffuse\" \"rgb L\" [20 20 20] \"integer nsamples\" "
    "3\n"
    "Shape \"sphere\" \"float radius\" .5\nAttributeEnd\n"
    "Texture \"c\" \"rgb\" \"checkerboard\" \"rgb tex1\" [.2 .2 .2] \"rgb tex2\" [.9 .8 .7]\n"
    "Material \"matte\" \"texture Kd\" \"c\"\n"
    "Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \"point P\" [-9 0 -9 9 0 -9 9 0 9 -9 0 9] "
    "\"point2 uv\" [0 0 8 0 8 8 0 8]\n"
    "AttributeBegin\nMaterial \"plastic\" \"float roughness\" .05\nTranslate -1 1 0\nActiveTransform "
    "1\nRotate 90 0 0 1\n"
    "ActiveTransform 2\nTranslate .5 0 0\nRotate 200 0 0 1\nActiveTransform All\nScale 1 .5 1\nShape "
    "\"sphere\" \"float radius\" .9\nAttributeEnd\n"
    "AttributeBegin\nMaterial \"glass\"\nTranslate 1.2 1 -1\nShape \"sphere\" \"float radius\" "
    ".7\nAttributeEnd\n";

TEST(Identity, ThreadsTilesAndCrops) {
    const BuiltScene built = test::build(kScene);
    const Image reference = test::render(built, 5, 1, 16).image;
    EXPECT_EQ(test::render(built, 5, 1, 16).stats.total.invalidSamples, 0u);
    for (int threads : {2, 7})
        EXPECT_TRUE(sameBits(reference, test::render(built, 5, threads, 16).image)) << threads;
    for (int tile : {1, 8, 13, 64, 256})
        EXPECT_TRUE(sameBits(reference, test::render(built, 5, 2, tile).image)) << tile;
    EXPECT_FALSE(sameBits(reference, test::render(built, 6, 2, 16).image)) << "the seed does nothing";

    BuildOptions options;
    options.crop = {.21f, .77f, .1f, .63f};
    const BuiltScene cropped = test::build(kScene, options);
    const Image part = test::render(cropped, 5).image;
    const PixelBounds w = cropped.pixelBounds;
    EXPECT_EQ(part.width, w.width());
    for (int y = w.y0; y < w.y1; ++y)
        EXPECT_EQ(
            0, std::memcmp(&part.at(0, y - w.y0), &reference.at(w.x0, y), sizeof(Rgb) * size_t(w.width())));
}

TEST(Identity, CropsTileTheFrame) {
    // Neighboring crops share no pixel and miss none.
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
