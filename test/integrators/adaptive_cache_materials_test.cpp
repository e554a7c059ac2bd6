// adaptive-cache with bump maps and layered materials.
#include "integrators/sharing_support.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::clippedError;
using test::oneLampFrame;
using test::render;

/// Returns the error of sharing light, relative to that of supersample, with four samples per pixel.
/// `scene(samples)`: its text.
template <class Scene>
double relativeErrorOfSharing(const Scene& scene, const std::string& share = "direct") {
    const Image reference = render(test::buildWith("supersample", scene(1024)), 99).image;
    const Image adaptive =
        render(test::buildWith("adaptive-cache", scene(4), {"share=" + share, "sampling=uniform"})).image;
    const Image own = render(test::buildWith("supersample", scene(4))).image;
    return clippedError(adaptive, reference) / clippedError(own, reference);
}

/// Returns a plane with wrinkles, of this size and height, that is lit by five colored lamps. Each sample
/// chooses one.
std::string bumpScene(int samples, const std::string& size, const std::string& height) {
    std::string text = oneLampFrame(samples) + R"(
LookAt 0 0 4  0 0 0  0 1 0
Camera "perspective" "float fov" 20
WorldBegin
)";
    const std::pair<const char*, const char*> lamps[] = {{"-3 2 2", "9 3 3"},
                                                         {"3 2 2", "3 9 3"},
                                                         {"0 -3 2", "3 3 9"},
                                                         {"-3 -2 3", "9 9 0"},
                                                         {"3 -2 3", "0 9 9"}};
    for (const auto& [position, radiance] : lamps)
        text += std::string("AttributeBegin Translate ") + position +
                " AreaLightSource \"diffuse\" \"rgb L\" [" + radiance +
                "] Shape \"sphere\" \"float radius\" .6 AttributeEnd\n";
    return text + "AttributeBegin Scale " + size + " " + size + " " + size + R"(
Texture "wrinkles" "float" "wrinkled" "integer octaves" 2
Texture "height" "float" "scale" "texture tex1" "wrinkles" "float tex2" )" +
           height + R"(
MakeNamedMaterial "bumps" "string type" "matte" "texture bumpmap" "height"
AttributeEnd
NamedMaterial "bumps"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-2 -2 0  2 -2 0  2 2 0  -2 2 0]
)";
}

/// Bumps of ten pixels. Fits over the geometric normal leave 0.14 of the error of `supersample`, fits over
/// the shading normal with derivatives that are always shrunk 0.05.
TEST(AdaptiveCacheMaterials, BumpsStaySharp) {
    EXPECT_LT(relativeErrorOfSharing([](int samples) { return bumpScene(samples, "1", ".3"); }), 0.04);
}

/// Bumps as wide as two cells. Without surfaces of their own for their slopes (surfaceOfTilt), 0.2 of the
/// error of `supersample` is left.
TEST(AdaptiveCacheMaterials, NarrowBumpsStaySharp) {
    EXPECT_LT(relativeErrorOfSharing([](int samples) { return bumpScene(samples, ".1", ".1"); }), 0.08);
}

/// A rough varnish over dark stripes in uniform light, at grazing angles: most light is reflected by the
/// varnish, which has no stripes. Division of light by the albedo alone would leave 0.43 of the error of
/// `supersample`.
TEST(AdaptiveCacheMaterials, GlossHasNoTexture) {
    const auto scene = [](int samples) {
        return R"(
Film "image" "integer xresolution" 96 "integer yresolution" 72
Sampler "sobol" "integer pixelsamples" )" +
               std::to_string(samples) + R"(
Integrator "path" "integer maxdepth" 1
LookAt 0 -6 2  0 0 0  0 0 1
Camera "perspective" "float fov" 20
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Texture "stripes" "rgb" "checkerboard" "float uscale" 30 "float vscale" 1
  "rgb tex1" [.02 .02 .02] "rgb tex2" [.3 .2 .1]
Material "metallicroughness" "texture basecolor" "stripes" "float metallic" 0 "float roughness" .4
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]
  "float uv" [0 0  1 0  1 1  0 1]
)";
    };
    EXPECT_LT(relativeErrorOfSharing(scene), 0.15);
}

/// Returns a checkered wall at z = 0, which a lamp lights, and a wall of another material at this z.
std::string checksScene(int samples, const std::string& lookAt, const std::string& material, float z) {
    return oneLampFrame(samples) + R"(
Integrator "path" "integer maxdepth" 4
LookAt )" + lookAt +
           R"(  0 1 0
Camera "perspective" "float fov" 20
WorldBegin
AttributeBegin
  Translate 0 1.5 .5
  AreaLightSource "diffuse" "rgb L" [20 20 20]
  Shape "sphere" "float radius" .3
AttributeEnd
Texture "checks" "rgb" "checkerboard" "float uscale" 24 "float vscale" 24 "rgb tex1" [.8 .8 .8] "rgb tex2" [.1 .2 .1]
Material "matte" "texture Kd" "checks"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-2 -2 0  2 -2 0  2 2 0  -2 2 0] "float uv" [0 0 1 0 1 1 0 1]
Material )" +
           material + "Translate 0 0 " + std::to_string(z) + R"(
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-2 -2 0  2 -2 0  2 2 0  -2 2 0]
)";
}

/// If the glass has estimates of its own, the checks are blurred: 0.14 of the error of `supersample`.
TEST(AdaptiveCacheMaterials, RoughGlassIsSeenThrough) {
    const auto scene = [](int samples) {
        return checksScene(samples, "0 0 4  0 0 0",
                           R"("glass" "float roughness" .02 "bool remaproughness" "false" )", 1);
    };
    EXPECT_LT(relativeErrorOfSharing(scene, "both"), 0.04);
}

/// The camera looks away from the checks, at metal that reflects them. If the metal has estimates of its own,
/// they are blurred: 0.44 of the error of `supersample`.
TEST(AdaptiveCacheMaterials, ReflectionsInPolishedMetalStaySharp) {
    const auto scene = [](int samples) {
        return checksScene(samples, "0 0 1  0 0 3", R"("metallicroughness" "float roughness" .04 )", 3);
    };
    EXPECT_LT(relativeErrorOfSharing(scene, "both"), 0.2);
}

} // namespace
} // namespace strobe
