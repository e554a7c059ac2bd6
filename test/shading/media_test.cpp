// Absorption in media behind surfaces of glass.
#include "shading/scene_template.h"
#include "support/render_text.h"
#include "support/scene_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Returns the scene of a camera that looks along z through the origin, under a uniform environment. The
/// world has unit spheres and disks of glass without refraction.
std::string sceneOf(const std::string& media, const std::string& world, const std::string& integrator) {
    return test::substitute(R"(
Film "image" "integer xresolution" 4 "integer yresolution" 4
Sampler "sobol" "integer pixelsamples" 256
Integrator "path" "integer maxdepth" 12
$integrator
LookAt 0 0 -10  0 0 0  0 1 0
Camera "perspective" "float fov" .01
$media
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Material "glass" "float index" 1
$world
)",
                            {{"$media", media}, {"$world", world}, {"$integrator", integrator}});
}

Rgb center(const std::string& media, const std::string& world, const std::string& integrator = "") {
    Diagnostics quiet;
    const std::set<std::string> integrators{"supersample", "msaa", "adaptive-cache"};
    return test::render(
               buildScene(parseText(sceneOf(media, world, integrator), "t.scene", integrators, quiet), {},
                          quiet))
        .image.at(2, 2);
}

void expectNear(const Rgb& a, const Rgb& b, float tolerance = 1e-4f) {
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a[c], b[c], tolerance);
}

Rgb transmittance(const Rgb& sigma, float distance) {
    return {std::exp(-sigma.x * distance), std::exp(-sigma.y * distance), std::exp(-sigma.z * distance)};
}

const char* kDye = R"(MakeNamedMedium "dye" "string type" "homogeneous" "float scale" 2
"rgb sigma_a" [.1 .5 2] "rgb sigma_s" [0 0 0]
)";
const Rgb kSigma(.2f, 1, 4);

TEST(Media, AbsorbByBeersLawAlongTheChord) {
    for (const char* integrator : {"", "Integrator \"msaa\"", "Integrator \"adaptive-cache\""})
        expectNear(center(kDye, R"(MediumInterface "dye" "" Scale .5 .5 .5 Shape "sphere")", integrator),
                   transmittance(kSigma, 1));
    // The outside of the inner sphere is in the dye, its inside is clear: the scale of the transform does not
    // scale the coefficients.
    expectNear(center(kDye, R"(MediumInterface "dye" "" Shape "sphere"
MediumInterface "" "dye" Scale .25 .25 .25 Shape "sphere")"),
               transmittance(kSigma, 1.5f), .01f);         // with Russian roulette
    expectNear(center(kDye, R"(Shape "sphere")"), Rgb(1)); // vacuum
    expectNear(center(kDye, R"(MediumInterface "dye" "" MediumInterface "" Shape "sphere")"), Rgb(1));
}

TEST(Media, AbsorbTheLightOfSurfacesInside) {
    expectNear(center(kDye, R"(MediumInterface "dye" "" Shape "sphere"
MediumInterface "" "dye"
AreaLightSource "diffuse" "rgb L" [1 2 3] "bool twosided" true
Material "matte" "rgb Kd" [0 0 0]
Shape "disk" "float radius" .5)"),
               transmittance(kSigma, 1) * Rgb(1, 2, 3));
}

TEST(Media, MovingGlassAbsorbs) {
    const std::string moving = R"(MediumInterface "dye" ""
AttributeBegin
ActiveTransform EndTime Translate 0 0 3 ActiveTransform All
Shape "sphere"
AttributeEnd)";
    expectNear(center(kDye, moving), transmittance(kSigma, 2));
}

/// A dense scattering medium in glass becomes an opaque surface of its color; a thin one absorbs only.
TEST(Media, DenseScatteringIsOpaque) {
    const std::string milk = R"(MakeNamedMedium "milk" "string type" "homogeneous"
"rgb sigma_a" [.01 .02 .2] "rgb sigma_s" [20 20 20]
)";
    const Rgb dense = center(milk, R"(MediumInterface "milk" "" Shape "sphere")");
    EXPECT_GT(dense.x, .5f);
    EXPECT_LT(dense.x, 1);
    EXPECT_GT(dense.x, dense.y);
    EXPECT_GT(dense.y, dense.z);
    const Rgb thin = center(milk, R"(MediumInterface "milk" "" Scale .01 .01 .01 Shape "sphere")");
    expectNear(thin, transmittance({.01f, .02f, .2f}, .02f));
}

TEST(Media, UnknownNamesAndParametersAreErrors) {
    const std::string misspelt = R"(MakeNamedMedium "dye" "string type" "homogeneous" "rgb sigmaa" [1 1 1]
)";
    EXPECT_THROW(test::build(sceneOf(misspelt, R"(Shape "sphere")", "")), Error);
    EXPECT_THROW(test::build(sceneOf(kDye, R"(MediumInterface "die" "" Shape "sphere")", "")), Error);
}

} // namespace
} // namespace strobe
