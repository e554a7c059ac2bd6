// Mixes, bump maps, rough glass, anisotropic metal, procedural textures and absorbing media, moving, through
// every integrator.
#include "integrators/sharing_support.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

const std::string kRich = R"(
Film "image" "integer xresolution" 24 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 16
Integrator "path" "integer maxdepth" 5
LookAt 0 2 -7  0 .6 0  0 1 0
Camera "perspective" "float fov" 38 "float shutterclose" 1
MakeNamedMedium "dye" "string type" "homogeneous" "rgb sigma_a" [.2 .8 2] "rgb sigma_s" [0 0 0]
WorldBegin
LightSource "infinite" "rgb L" [.4 .5 .6]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [9 8 7]
Translate 0 4 0 Rotate 90 1 0 0
Shape "disk" "float radius" 1
AttributeEnd
Texture "stone" "rgb" "marble" "float scale" 3
Texture "bumps" "float" "wrinkled" "integer octaves" 3
Texture "spots" "float" "dots" "float uscale" 8 "float vscale" 8
MakeNamedMaterial "stone" "string type" "matte" "texture Kd" "stone" "texture bumpmap" "bumps"
MakeNamedMaterial "metal" "string type" "metallicroughness" "float metallic" 1 "float roughness" .3
  "float vroughness" .8 "rgb basecolor" [.9 .7 .4]
MakeNamedMaterial "both" "string type" "mix" "string materials" ["stone" "metal"] "texture amount" "spots"
NamedMaterial "stone"
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
AttributeBegin
NamedMaterial "both"
ActiveTransform EndTime Translate .4 .2 0 ActiveTransform All
Translate -1.3 1 0
Shape "sphere"
AttributeEnd
AttributeBegin
MediumInterface "dye" ""
Material "glass" "float roughness" .05
ActiveTransform EndTime Translate 0 .3 0 ActiveTransform All
Translate 1.3 1 0
Shape "sphere"
AttributeEnd
)";

double meanOf(const PixelStatistics& s) {
    double sum = 0;
    for (const double m : s.mean)
        sum += m / double(s.mean.size());
    return sum;
}

double errorOf(const PixelStatistics& s) {
    double sum = 0;
    for (const double e : s.error)
        sum += e * e;
    return std::sqrt(sum) / double(s.error.size());
}

TEST(RichMaterials, HaveTheSameLightThroughEveryIntegrator) {
    constexpr int kSeeds = 24;
    const PixelStatistics reference = renderSeeds(buildWith("supersample", kRich), kSeeds, 100);
    EXPECT_GT(meanOf(reference), .1);
    for (const char* name : {"msaa", "msaa-cache", "indirect-cache", "adaptive-cache"}) {
        const PixelStatistics s = renderSeeds(buildWith(name, kRich), kSeeds);
        const double bias = std::string(name) == "msaa" ? 0 : .01; // the others may be biased
        EXPECT_NEAR(meanOf(s), meanOf(reference),
                    bias * meanOf(reference) + 5 * (errorOf(s) + errorOf(reference)))
            << name;
    }
}

TEST(RichMaterials, BitsDoNotDependOnThreadsOrTiles) {
    const BuiltScene scene = buildWith("supersample", kRich);
    EXPECT_TRUE(haveEqualBits(render(scene, 1, 2, 16).image, render(scene, 1, 1, 7).image));
}

} // namespace
} // namespace strobe::test
