// Files of other programs: unsupported constructs become the nearest supported ones, with one warning each.
#include "support/render_text.h"
#include "support/scene_files.h"
#include "support/scene_text.h"

#include <gtest/gtest.h>

#include <fstream>

namespace strobe {
namespace {

namespace fs = std::filesystem;

const std::string kView = R"(Film "image" "integer xresolution" 16 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 16
LookAt 0 -4 2  0 0 0  0 0 1
Camera "perspective" "float fov" 40
)";
const std::string kV4 = kView + R"(Integrator "path" )";
const std::string kV2 = kView + R"(SurfaceIntegrator "path" )";
const std::string kLit = R"(WorldBegin
LightSource "infinite" "rgb L" [.5 .6 .7]
LightSource "point" "rgb I" [9 8 7] "point from" [2 -3 3]
)";
const std::string kLitV2 = R"(WorldBegin
LightSource "infinite" "color L" [.5 .6 .7]
LightSource "point" "color I" [9 8 7] "point from" [2 -3 3]
)";
const std::string kBall = R"(Shape "sphere" )";

struct Loaded {
    Image image;
    std::vector<std::string> warnings; ///< without location, source line and caret
};

Loaded load(const std::string& text, const std::string& name = "test.pbrt") {
    Loaded loaded;
    Diagnostics diagnostics([&](const std::string& formatted) {
        const std::string line = formatted.substr(0, formatted.find('\n'));
        const size_t begin = line.find("note: ");
        loaded.warnings.push_back(begin != std::string::npos ? line.substr(begin)
                                                             : line.substr(line.find("warning: ") + 9));
    });
    loaded.image =
        test::render(buildScene(parseText(text, name, {"supersample"}, diagnostics), {}, diagnostics)).image;
    return loaded;
}

bool equal(const Image& a, const Image& b) {
    return std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), b.pixels.end());
}

/// A material of pbrt-v3 or v4, and the material of strobe that it must equal.
struct MaterialPair {
    const char* pbrt;
    const char* strobe;
    std::string replacement{}; ///< end of the warning "material "NAME" is not supported; "; empty: no warning
};

class Materials : public testing::TestWithParam<MaterialPair> {};

TEST_P(Materials, RenderAsTheirReplacements) {
    const MaterialPair& pair = GetParam();
    const std::string floor = R"(Shape "disk" "float radius" 3 "float height" -1 )";
    // The material occurs twice: it is warned about once.
    const Loaded pbrt = load(kV4 + kLit + "Material " + pair.pbrt + kBall + floor + "Material " + pair.pbrt);
    const Loaded strobe = load(kV4 + kLit + "Material " + pair.strobe + kBall + floor);
    EXPECT_TRUE(equal(pbrt.image, strobe.image));
    std::vector<std::string> expected;
    if (const std::string text = pair.pbrt; !pair.replacement.empty())
        expected.push_back("material " + text.substr(0, text.find('"', 1) + 1) + " is not supported; " +
                           pair.replacement);
    EXPECT_EQ(pbrt.warnings, expected);
    EXPECT_GT(luminance(pbrt.image.at(8, 8)), .01f);
}

const std::string kMetallicRoughness = R"("metallicroughness" is used instead)";
const std::string kLargestLobes =
    R"(its largest lobes are rendered as "plastic" (pbrt-v2), "metallicroughness" or "glass")";
const std::string kWithoutGloss = R"("diffusetransmission" is used instead; its gloss is ignored)";
const std::string kMatte = R"("matte" is used instead)";
const std::string kGrayMatte = R"(a gray "matte" is used instead)";

// Roughness r of metallicroughness has alpha = r².
INSTANTIATE_TEST_SUITE_P(
    CompatPlugin, Materials,
    testing::Values(
        MaterialPair{R"("diffuse" "rgb reflectance" [.7 .2 .1] )", R"("matte" "rgb Kd" [.7 .2 .1] )"},
        MaterialPair{R"("dielectric" "float eta" 1.3 )", R"("glass" "float index" 1.3 )"},
        // Of a black base, only the coat remains.
        MaterialPair{
            R"("coateddiffuse" "rgb reflectance" [0 0 0] "float roughness" .0625 "float eta" 1.4 )",
            R"("metallicroughness" "rgb basecolor" [0 0 0] "float metallic" 0 "float roughness" .5 "float ior" 1.4 )",
            kMetallicRoughness},
        MaterialPair{
            R"("coateddiffuse" "rgb reflectance" [0 0 0] "float roughness" .25 "bool remaproughness" false )",
            R"("metallicroughness" "rgb basecolor" [0 0 0] "float metallic" 0 "float roughness" .5 )",
            kMetallicRoughness},
        MaterialPair{
            R"("conductor" "rgb reflectance" [.9 .8 .5] "float uroughness" .0625 "float vroughness" .0625 )",
            R"("metallicroughness" "rgb basecolor" [.9 .8 .5] "float roughness" .5 )", kMetallicRoughness},
        MaterialPair{R"("conductor" "rgb eta" [1 1 1] "rgb k" [2 2 2] "float roughness" .0625 )", // k²/(4+k²)
                     R"("metallicroughness" "rgb basecolor" [.5 .5 .5] "float roughness" .5 )",
                     kMetallicRoughness},
        MaterialPair{
            R"("coatedconductor" "rgb reflectance" [1 1 1] "float conductor.roughness" .0625 "float interface.roughness" 0 )",
            R"("metallicroughness" "rgb basecolor" [1 1 1] "float roughness" .5 "float clearcoat" 1 )",
            kMetallicRoughness},
        MaterialPair{
            R"("substrate" "rgb Kd" [.7 .2 .1] "rgb Ks" [.04 .04 .04] "float uroughness" .25 "float vroughness" .25 "bool remaproughness" false )",
            R"("metallicroughness" "rgb basecolor" [.7 .2 .1] "float metallic" 0 "float roughness" .5 )",
            kMetallicRoughness},
        MaterialPair{R"("uber" "rgb Kd" [.1 .1 .1] "rgb Kt" [.8 .9 .8] "rgb Kr" [1 1 1] "float eta" 1.3 )",
                     R"("glass" "rgb Kt" [.8 .9 .8] "float eta" 1.3 )", kLargestLobes},
        MaterialPair{
            R"("uber" "rgb Kd" [.7 .2 .1] "rgb Ks" [0 0 0] "rgb Kr" [1 1 1] )",
            R"("metallicroughness" "rgb basecolor" [.7 .2 .1] "float metallic" 0 "float roughness" 0 )",
            kLargestLobes},
        MaterialPair{
            R"("disney" "rgb color" [.7 .2 .1] "float metallic" .5 "float roughness" .4 "float eta" 1.4 )",
            R"("metallicroughness" "rgb basecolor" [.7 .2 .1] "float metallic" .5 "float roughness" .4 "float ior" 1.4 )",
            kMetallicRoughness},
        MaterialPair{R"("shinymetal" )", R"("mirror" "rgb Kr" [1 1 1] )",
                     R"("mirror" or "metallicroughness" is used instead)"},
        MaterialPair{
            R"("thindielectric" "float eta" 1.4 )",
            R"("metallicroughness" "float metallic" 0 "float roughness" 0 "float ior" 1.4 "float transmission" 1 )",
            kMetallicRoughness},
        MaterialPair{
            R"("translucent" "rgb Kd" [.5 .5 .25] "rgb reflect" [.5 .5 .5] "rgb transmit" [.25 .25 .25] )",
            R"("diffusetransmission" "rgb reflectance" [.25 .25 .125] "rgb transmittance" [.125 .125 .0625] )",
            kWithoutGloss},
        MaterialPair{R"("hair" "rgb color" [.5 .3 .1] )", R"("matte" "rgb Kd" [.5 .3 .1] )", kMatte},
        MaterialPair{R"("fourier" "string bsdffile" "x.bsdf" )", R"("matte" )", kGrayMatte}));

TEST(CompatPlugin, UberOfVersion2IsPlastic) {
    const std::string lobes = R"( "color Kd" [.4 .3 .2] "color Ks" [.5 .4 .3] "float roughness" .05 )";
    EXPECT_TRUE(equal(load(kV2 + kLitV2 + R"(Material "uber")" + lobes + kBall).image,
                      load(kV2 + kLitV2 + R"(Material "plastic")" + lobes + kBall).image));
}

TEST(CompatPlugin, RoughnessOfVersion3IsMappedByItsPolynomial) {
    // At roughness 1 the polynomial is 1.62, which is clamped to alpha 1.
    const std::string color = R"( "rgb Kd" [.4 .3 .2] "rgb Ks" [.04 .04 .04])";
    EXPECT_TRUE(
        equal(load(kV4 + kLit + R"(Material "substrate")" + color +
                   R"( "float uroughness" 1 "float vroughness" 1 )" + kBall)
                  .image,
              load(kV4 + kLit +
                   R"(Material "metallicroughness" "rgb basecolor" [.4 .3 .2] "float metallic" 0 )" + kBall)
                  .image));
}

TEST(CompatPlugin, TexturedInputsAreCarriedOver) {
    const auto board = [](const std::string& name, const std::string& type, const std::string& values) {
        // Unfiltered, since the mean of square roots is not the square root of the mean.
        return R"(Texture ")" + name + R"(" ")" + type + R"(" "checkerboard" "float uscale" 8 )" + values +
               R"( "string aamode" "none" )";
    };
    const std::string textures =
        kV4 + kLit + board("color", "spectrum", R"("rgb tex1" [.9 .1 .1] "rgb tex2" [.1 .1 .9])") +
        board("alpha", "float", R"("float tex1" .0625 "float tex2" 1)") +
        board("root", "float", R"("float tex1" .5 "float tex2" 1)");
    EXPECT_TRUE(equal(
        load(textures + R"(Material "conductor" "texture reflectance" "color" "texture roughness" "alpha" )" +
             kBall)
            .image,
        load(
            textures +
            R"(Material "metallicroughness" "texture basecolor" "color" "texture roughness" "root" "float metallic" 1 )" +
            kBall)
            .image));
}

/// The mean color of a large disk, seen along its normal, under light of radiance 1 from everywhere.
Rgb furnace(const std::string& material) {
    const Image image = load(R"(Film "image" "integer xresolution" 16 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 256
LookAt 0 0 4  0 0 0  0 1 0
Camera "perspective" "float fov" 1
Integrator "path"
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Material )" + material + R"( Shape "disk" "float radius" 3 )")
                            .image;
    Rgb sum(0);
    for (const Rgb& pixel : image.pixels)
        sum += pixel / float(image.pixels.size());
    return sum;
}

/// A smooth coat of index 1.5 on a Lambertian base, seen along the normal: F + (1 - F) rho T / (1 - rho (1 -
/// T)) with F = .04 and T = (1 - .0918) / 1.5² (the diffuse reflectance of the boundary is .0918 from
/// outside).
TEST(CompatPlugin, CoatedDiffuseHasTheLightThatBouncesInTheCoat) {
    constexpr float kTransmittance = (1 - .0918f) / 2.25f;
    for (const auto& [rho, expected] : {std::pair(.8f, .63f), {.3f, .18f}, {.05f, .06f}}) {
        const float closed = .04f + .96f * rho * kTransmittance / (1 - rho * (1 - kTransmittance));
        EXPECT_NEAR(closed, expected, .006f);
        const std::string value = std::to_string(rho);
        const Rgb color =
            furnace(R"("coateddiffuse" "rgb reflectance" [)" + value + " " + value + " " + value + "]");
        EXPECT_NEAR(color.x, closed, .012f) << rho;
        EXPECT_NEAR(color.z, closed, .012f) << rho;
    }
}

/// Parallel boundaries: F + (1 - F)² R / (1 - F R), seen along the normal.
TEST(CompatPlugin, CoatedConductorHasTheLightThatBouncesInTheCoat) {
    for (const float r : {.9f, .5f, .1f}) {
        const float closed = .04f + .96f * .96f * r / (1 - .04f * r);
        const std::string value = std::to_string(r);
        const Rgb color =
            furnace(R"("coatedconductor" "rgb reflectance" [)" + value + " " + value + " " + value + "]");
        EXPECT_NEAR(color.y, closed, .012f) << r;
    }
}

/// A wall that reflects and transmits all light is invisible in a furnace.
TEST(CompatPlugin, DiffuseTransmissionPassesTheLightOfTheOtherSide) {
    const Rgb white =
        furnace(R"("diffusetransmission" "rgb reflectance" [.4 .4 .4] "rgb transmittance" [.6 .6 .6])");
    EXPECT_NEAR(white.x, 1, .01f);
    const Rgb half =
        furnace(R"("diffusetransmission" "rgb reflectance" [.2 .2 .2] "rgb transmittance" [.3 .3 .3])");
    EXPECT_NEAR(half.y, .5f, .01f);
}

/// The radiance of the background.
Rgb background(const std::string& film, const std::string& light) {
    return load("Film \"" + film + R"(" "integer xresolution" 2 "integer yresolution" 2
Camera "perspective"
Integrator "path"
WorldBegin
LightSource "infinite" )" +
                light)
        .image.at(0, 0);
}

TEST(CompatPlugin, SpectraOfLightsAreColorsInVersion4) {
    for (const char* kelvin : {"1500", "2000", "2700", "4000", "6500", "10000"}) {
        const Rgb v4 = background("rgb", std::string(R"("blackbody L" [)") + kelvin + R"(] "float scale" 2)");
        EXPECT_NEAR(luminance(v4), 2, 1e-4f) << kelvin;
        const Rgb v3 = background("image", std::string(R"("blackbody L" [)") + kelvin + " 2]");
        EXPECT_NEAR(v3.x / luminance(v3), v4.x / luminance(v4), 1e-3f) << kelvin;
    }
    EXPECT_LT(luminance(background("image", R"("blackbody L" [2000 1])")), .1f);
    EXPECT_NEAR(luminance(background("rgb", R"("spectrum L" [300 30 800 30])")), 1, 1e-4f);
    EXPECT_NEAR(luminance(background("image", R"("spectrum L" [300 30 800 30])")), 30, .1f);
    EXPECT_NEAR(luminance(background("rgb", R"("rgb L" [.2 .2 .2])")), .2f, 1e-5f);
}

TEST(CompatPlugin, TransformsWithoutInverseMayStandWhereNothingUsesThem) {
    const std::string unused = "AttributeBegin\nScale 0 1 1\nTranslate 1 0 0\nAttributeEnd\nTransformBegin\n"
                               "ConcatTransform [1 2 3 0 2 4 6 0 0 0 1 0 0 0 0 1]\nTransformEnd\n";
    EXPECT_TRUE(equal(load(kV4 + kLit + unused + kBall).image, load(kV4 + kLit + kBall).image));
    EXPECT_TRUE(
        equal(load(kV4 + kLit + "Scale 0 1 1\nIdentity\n" + kBall).image, load(kV4 + kLit + kBall).image));
    for (const char* user : {R"(Shape "sphere")", R"(LightSource "point" "rgb I" 1 1 1)"})
        EXPECT_THROW(load(kV4 + kLit + "Scale 0 1 1\n" + user), Error);
    Diagnostics quiet;
    EXPECT_THROW(parseText(kV4 + kLit + unused, "s.scene", {"supersample"}, quiet), Error);
}

TEST(CompatPlugin, ParametersContinueAfterAnInclude) {
    test::TemporaryFolder folder;
    folder.write("ball.pbrt", R"(Material "matte" "rgb Kd" [.9 .2 .1]
Shape "sphere" "float zmin" -.5)");
    const auto rendered = [&](const std::string& text) {
        Diagnostics diagnostics;
        const fs::path file = folder.write("main.pbrt", kV4 + kLit + text);
        return test::render(buildScene(parseFiles({file}, {"supersample"}, diagnostics), {}, diagnostics))
            .image;
    };
    const std::string disk = R"(Shape "disk" "float height" -1 )";
    EXPECT_TRUE(equal(
        rendered(R"(Include "ball.pbrt" "float radius" .7 )" + disk),
        rendered(
            R"(Material "matte" "rgb Kd" [.9 .2 .1] Shape "sphere" "float zmin" -.5 "float radius" .7 )" +
            disk)));
    EXPECT_THROW(rendered(R"(Include "ball.pbrt" "float radiu" )"), Error);
}

/// A mix of two mattes under uniform light is as bright as their mean. The amount is the weight of the first
/// material in pbrt-v3, of the second in v4.
TEST(CompatPlugin, MixesHaveTheMeanOfTheirMaterials) {
    const std::string two = R"(MakeNamedMaterial "a" "string type" "matte" "rgb Kd" [.8 .8 .8]
MakeNamedMaterial "b" "string type" "matte" "rgb Kd" [.2 .2 .2]
MakeNamedMaterial "c" "string type" "mix" "string namedmaterial1" "a" "string namedmaterial2" "b"
Texture "half" "spectrum" "checkerboard" "rgb tex1" [0 0 0] "rgb tex2" [1 1 1] "float uscale" 100
)";
    const auto mean = [&](const std::string& parameters) {
        const Loaded loaded = load(kV4 + kLit + two + R"(Material "mix" )" + parameters + kBall);
        EXPECT_EQ(loaded.warnings, std::vector<std::string>{});
        double sum = 0;
        for (const Rgb& c : loaded.image.pixels)
            sum += c.y;
        return sum;
    };
    const std::string v3 = R"("string namedmaterial1" "a" "string namedmaterial2" "b" )";
    const std::string v4 = R"("string materials" ["a" "b"] )";
    const double bright = mean(v3 + R"("rgb amount" [1 1 1] )"), dark = mean(v3 + R"("rgb amount" [0 0 0] )");
    EXPECT_GT(bright, dark + 10);
    EXPECT_EQ(mean(v4 + R"("float amount" 0 )"), bright);
    const auto weightOfFirst = [&](const std::string& parameters) {
        return (mean(parameters) - dark) / (bright - dark);
    };
    EXPECT_NEAR(weightOfFirst(v3 + R"("rgb amount" [.7 .7 .7] )"), .7, .05);
    EXPECT_NEAR(weightOfFirst(v4 + R"("float amount" .7 )"), .3, .05);
    EXPECT_NEAR(weightOfFirst(v3 + R"("texture amount" "half" )"), .5, .05);
    EXPECT_NEAR(weightOfFirst(R"("string materials" ["a" "c"] "float amount" .5 )"), .75, .05);
    EXPECT_THROW(load(kV4 + kLit + two + R"(Material "mix" "float amont" 1 )" + v4 + kBall, "t.scene"),
                 Error);
}

TEST(CompatPlugin, BoundariesOfMediaAreSkippedUnlessTheyEmit) {
    const std::string floor = R"(Shape "disk" "float radius" 3 "float height" -1 )";
    for (const char* name : {"", "none", "interface"}) {
        const std::string material = std::string(R"(Material ")") + name + R"(" )";
        EXPECT_TRUE(equal(load(kV4 + kLit + floor + material + kBall).image, load(kV4 + kLit + floor).image))
            << name;
        const std::string emitter = R"(AreaLightSource "diffuse" "rgb L" [2 2 2] )" + kBall;
        EXPECT_TRUE(equal(load(kV4 + kLit + material + emitter).image,
                          load(kV4 + kLit + R"(Material "matte" "rgb Kd" [0 0 0] )" + emitter).image))
            << name;
    }
}

TEST(CompatPlugin, OpacityOfUberIsTheAlphaOfItsMeshes) {
    const std::string mesh =
        R"(Shape "trianglemesh" "integer indices" [0 1 2] "point P" [-1 0 -1  1 0 -1  0 0 1])";
    const std::string uber = R"(Material "uber" "rgb Ks" [0 0 0] "rgb opacity" )";
    EXPECT_TRUE(equal(load(kV4 + kLit + uber + "[.3 .3 .3]\n" + mesh).image,
                      load(kV4 + kLit + uber + "[1 1 1]\n" + mesh + R"( "float alpha" .3 )").image));
    EXPECT_FALSE(equal(load(kV4 + kLit + uber + "[.3 .3 .3]\n" + mesh).image,
                       load(kV4 + kLit + uber + "[1 1 1]\n" + mesh).image));
}

TEST(CompatPlugin, FilmScaleMultipliesAllLights) {
    const auto scene = [](const std::string& film, const std::string& scale) {
        std::string text = kV4;
        text.insert(text.find('\n'), film);
        return text + R"(WorldBegin
LightSource "infinite" "rgb L" [.5 .6 .7] "float scale" )" +
               scale +
               R"(
AreaLightSource "diffuse" "float scale" )" +
               scale + "\n" + kBall;
    };
    const Image twice = load(scene("", "2")).image;
    EXPECT_TRUE(equal(load(scene(R"( "float scale" 2)", "1")).image, twice));
    EXPECT_TRUE(equal(load(scene(R"( "float iso" 400 "float exposuretime" .5)", "1")).image, twice));
}

TEST(CompatPlugin, PowerAndIlluminanceScaleLights) {
    const auto lit = [](const std::string& light) {
        return load(kV4 + "WorldBegin\n" + light + kBall).image;
    };
    const auto near = [](const Image& a, const Image& b) {
        for (size_t i = 0; i < a.pixels.size(); ++i)
            EXPECT_NEAR(a.pixels[i].x, b.pixels[i].x, 1e-4f * (1 + b.pixels[i].x)) << i;
        EXPECT_GT(b.at(8, 8).x, .01f);
    };
    const std::string from = R"( "point3 from" [0 -3 1] )";
    near(lit(R"(LightSource "point" "float power" 100)" + from),
         lit(R"(LightSource "point" "rgb I" [7.9577472 7.9577472 7.9577472])" + from));
    near(lit(R"(LightSource "distant" "float illuminance" 3)" + from),
         lit(R"(LightSource "distant" "rgb L" [3 3 3])" + from));
    near(lit(R"(LightSource "infinite" "float illuminance" 3.1415927 )"), lit(R"(LightSource "infinite" )"));
    const std::string area = R"(Translate 0 0 2
ReverseOrientation
AreaLightSource "diffuse" )",
                      disk = R"(
Shape "disk" "float radius" 2
)";
    near(lit("AttributeBegin\n" + area + R"("float power" 39.4784176)" + disk + "AttributeEnd\n"),
         lit("AttributeBegin\n" + area + R"("rgb L" [1 1 1])" + disk + "AttributeEnd\n")); // π · 4π
}

TEST(CompatPlugin, HarmlessMistakesInPbrtFilesAreWarnings) {
    const auto warning = [](const std::string& text) {
        const Loaded loaded = load(kV4 + kLit + kBall + text);
        return loaded.warnings.size() == 1 ? loaded.warnings[0]
                                           : "not one warning, but " + std::to_string(loaded.warnings.size());
    };
    EXPECT_EQ(warning("Translate 1, 2, 0\nTranslate 1, 0, 0\n"), "note: commas between numbers are ignored");
    EXPECT_EQ(warning(R"(Texture "a, b" "float" "constant" # c, d
)"),
              "not one warning, but 0");
    EXPECT_EQ(warning(R"(Shape "sphere" "float radius" .1 "float radius" .2
Shape "sphere" "float radius" .1 "float radius" .2
)"),
              R"(parameter "radius" is given twice; the last value is used)");
    EXPECT_EQ(warning("WorldEnd\nFilm \"image\"\nWorldBegin\nWorldEnd\n"),
              "all after WorldEnd is ignored: a run renders one scene");
    EXPECT_EQ(warning(R"(Texture "t" "color" "constant"
Material "matte" "texture Kd" "t" "rgb Kd" [1 0 0] )"),
              R"(parameter "Kd" is given twice; the texture is used)");
    EXPECT_EQ(
        warning(R"(Material "matte" "spectrum Kd" [.8 .8 .8] )"),
        R"(parameter "Kd" needs pairs of a wavelength and a value, got 3 numbers; those at the end are ignored)");
    EXPECT_EQ(warning(R"(Material "matte" "rgb Kd" .5 )"),
              R"(parameter "Kd" needs triples of numbers, got 1 number; the parameter is ignored)");
    EXPECT_EQ(warning(R"(NamedMaterial "lost" )"), R"(unknown material "lost" ("matte" is used instead))");
    EXPECT_EQ(warning(R"(ObjectInstance "lost"
ObjectInstance "lost"
)"),
              R"(unknown object "lost" (its instances are skipped))");
    EXPECT_EQ(warning(R"(Material "matte" "texture Kd" "lost" )"),
              R"(unknown texture "lost" (the parameter keeps its default))");
    EXPECT_EQ(warning(R"(Material "carpaint" "rgb color" [1 1 1] )"),
              R"(unknown material "carpaint"; "matte" is used instead)");
    EXPECT_EQ(warning(R"(Texture "wood" "spectrum" "trunk" "float rings" 9
Material "matte" "texture Kd" "wood" Shape "sphere" )"),
              R"(unknown texture "trunk"; parameters keep their defaults)");
    EXPECT_EQ(warning(R"(Shape "teapot" "float size" 2 )"), R"(unknown shape "teapot"; it is skipped)");
    EXPECT_EQ(warning(R"(AttributeBegin
AreaLightSource "portal"
Shape "sphere"
AttributeEnd
)"),
              R"(unknown area light "portal"; it is skipped)");
    EXPECT_EQ(warning(R"(AttributeBegin
ObjectBegin "o"
AttributeEnd
Shape "sphere"
ObjectEnd
)"),
              "AttributeEnd does not match ObjectBegin (test.pbrt:9:1); the state that was saved last is "
              "restored, as in pbrt");
    EXPECT_EQ(warning(R"(LightSource "laser" "float size" 2 )"), R"(unknown light "laser"; it is skipped)");
    EXPECT_EQ(warning(R"(Shape "trianglemesh" "point P" [] "integer indices" [] )"),
              "note: a mesh without triangles is ignored");
    EXPECT_EQ(warning(R"(Shape "sphere" "float sheen" 1
Shape "sphere" "float sheen" 1
)"),
              R"(parameter "sheen" is ignored (known: radius, zmin, zmax, phimax, name))");
}

TEST(CompatPlugin, NumbersOfColorsAreReadAsInPbrt) {
    const auto picture = [](const std::string& kd) {
        return load(kV4 + kLit + "Material \"matte\" " + kd + " " + kBall).image;
    };
    EXPECT_TRUE(equal(picture(R"("spectrum Kd" [700 .1 500 .8 400 .3])"),
                      picture(R"("spectrum Kd" [400 .3 500 .8 700 .1])")));
    EXPECT_TRUE(equal(picture(R"("spectrum Kd" [400 .3 500])"), picture(R"("spectrum Kd" [400 .3])")));
    EXPECT_TRUE(equal(picture(R"("rgb Kd" [.1 .2 .3 .4])"), picture(R"("rgb Kd" [.1 .2 .3])")));
    EXPECT_TRUE(equal(picture(R"("rgb Kd" .2)"), picture("")));
    const Loaded unknown = load(
        kV4 + kLit + R"(Texture "wood" "spectrum" "trunk" Material "matte" "texture Kd" "wood" )" + kBall);
    EXPECT_TRUE(equal(unknown.image, picture("")));
    EXPECT_FALSE(equal(picture(R"("rgb Kd" [.1 .2 .3])"), picture("")));
}

TEST(CompatPlugin, OtherLightSamplersBecomeAuto) {
    const auto with = [](const std::string& strategy) {
        return load(kView + R"(Integrator "path" "string lightsamplestrategy" ")" + strategy + R"(" )" +
                    kLit + kBall);
    };
    const Loaded all = with("all"), unknown = with("photontree");
    EXPECT_FALSE(equal(all.image, with("one").image));
    EXPECT_TRUE(equal(with("bvh").image, with("spatial").image));
    EXPECT_TRUE(with("exhaustive").warnings.empty());
    EXPECT_TRUE(equal(all.image, unknown.image));
    EXPECT_EQ(
        unknown.warnings,
        std::vector<std::string>{
            R"("strategy" must be "auto", "all", "weighted", "one", "power", "uniform", "tree", "bvh", "spatial", "exhaustive"; not "photontree"; "auto" takes its place)"});
}

TEST(CompatPlugin, HarmlessMistakesInSceneFilesAreErrors) {
    for (const char* text : {"Translate 1, 2, 0\n", R"(Shape "sphere" "float radius" 1 "float radius" 2 )",
                             R"(NamedMaterial "lost" )", R"(ObjectInstance "lost" )",
                             R"(Material "carpaint" )", R"(Shape "teapot" )", R"(AttributeBegin
ObjectBegin "o"
AttributeEnd
ObjectEnd
)",
                             R"(Shape "trianglemesh" "point P" [] "integer indices" [] )"})
        EXPECT_THROW(load(kV4 + kLit + text, "test.scene"), Error) << text;
}

/// Returns the largest distance of the mesh's vertices from a surface. `distance`: 0 on the surface.
float deviation(const std::string& shape, const std::function<float(const V3f&)>& distance) {
    Diagnostics quiet;
    const BuiltScene built =
        buildScene(parseText(kV4 + kLit + shape, "test.pbrt", {"supersample"}, quiet), {}, quiet);
    const PlacedShape& placed = built.scene->groups()[0].geometries.at(0).placed;
    float largest = placed.shape.mesh->indices.empty() ? 1 : 0;
    for (size_t i = 0; i < placed.shape.mesh->positions[0].size(); ++i)
        largest = std::max(largest, std::abs(distance(placed.shape.mesh->positions[0][i])));
    return largest;
}

TEST(CompatPlugin, ShapesLieOnTheirSurfaces) {
    const auto r = [](const V3f& p) { return std::hypot(p.x, p.y); };
    EXPECT_LT(deviation(R"(Shape "cylinder" "float radius" 2 )", [&](const V3f& p) { return r(p) - 2; }),
              1e-5f);
    EXPECT_LT(deviation(R"(Shape "cone" "float radius" 2 "float height" 4 )",
                        [&](const V3f& p) { return r(p) - (4 - p.z) / 2; }),
              1e-5f);
    EXPECT_LT(deviation(R"(Shape "paraboloid" "float radius" 2 "float zmax" 4 )",
                        [&](const V3f& p) { return r(p) * r(p) - p.z; }),
              1e-5f);
    EXPECT_LT(
        deviation(
            R"(Shape "hyperboloid" "point3 p1" [1 0 -1] "point3 p2" [1 2 1] )", // pbrt's ah, ch: 2/7, 3/7
            [&](const V3f& p) { return r(p) * r(p) - 3.5f - 1.5f * p.z * p.z; }),
        1e-5f);
    EXPECT_LT(deviation(R"(Shape "bilinearmesh" "point3 P" [0 0 1  1 0 1  0 1 1  1 1 1] )",
                        [](const V3f& p) { return p.z - 1; }),
              1e-6f);
    EXPECT_LT(deviation(R"(Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 1] )",
                        [](const V3f& p) { return p.z - p.x * p.y; }),
              1e-6f);
    EXPECT_LT(deviation(R"(Shape "curve" "point3 P" [0 0 0  0 0 1  0 0 2  0 0 3] "float width" .2 )",
                        [&](const V3f& p) { return r(p) - .1f; }),
              1e-5f);
    EXPECT_LT(
        deviation(
            R"(Shape "curve" "string basis" "bspline" "point3 P" [0 0 0  0 0 1  0 0 2  0 0 3  0 0 4] "float width" .2 )",
            [&](const V3f& p) { return std::max(r(p) - .1f, std::abs(p.z - 2) - 1); }),
        1e-5f);
}

/// A patch whose texture coordinates are not affine differs from two triangles; one with affine coordinates
/// is two.
TEST(CompatPlugin, PatchesInterpolateBilinearly) {
    const auto meshOf = [](const std::string& shape) {
        Diagnostics quiet;
        const BuiltScene built =
            buildScene(parseText(kV4 + kLit + shape, "test.pbrt", {"supersample"}, quiet), {}, quiet);
        return *built.scene->groups()[0].geometries.at(0).placed.shape.mesh;
    };
    const std::string square = R"(Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 0] )";
    EXPECT_EQ(meshOf(square).triangleCount(), 2u);
    EXPECT_EQ(meshOf(square + R"("point2 uv" [3 1  5 1  3 9  5 9])").triangleCount(), 2u);
    const TriangleMesh crossed = meshOf(square + R"("point2 uv" [0 0  1 0  1 1  0 1])");
    ASSERT_EQ(crossed.triangleCount(), 128u);
    for (size_t i = 0; i < crossed.vertexCount(); ++i) {
        const V3f& p = crossed.positions[0][i];
        EXPECT_NEAR(crossed.uvs[i].x, p.x * (1 - p.y) + (1 - p.x) * p.y, 1e-6f);
        EXPECT_NEAR(crossed.uvs[i].y, p.y, 1e-6f);
        EXPECT_EQ(crossed.normals[0][i], V3f(0, 0, 1));
    }
    const TriangleMesh saddle = meshOf(R"(Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 1] )");
    for (size_t i = 0; i < saddle.vertexCount(); ++i) {
        const V3f& p = saddle.positions[0][i];
        EXPECT_LT(length(saddle.normals[0][i] - normalize(V3f(-p.y, -p.x, 1))), 1e-5f);
    }
}

TEST(CompatPlugin, ShapesFaceOutwards) {
    for (const char* shape : {R"(Shape "cylinder" )", R"(Shape "paraboloid" )"}) {
        Diagnostics quiet;
        const BuiltScene built =
            buildScene(parseText(kV4 + kLit + shape, "test.pbrt", {"supersample"}, quiet), {}, quiet);
        const TriangleMesh& mesh = *built.scene->groups()[0].geometries.at(0).placed.shape.mesh;
        V3f v[3];
        triangleVertices(mesh, uint32_t(mesh.triangleCount() / 2), 0, v);
        const V3f n = cross(v[1] - v[0], v[2] - v[0]);
        EXPECT_GT(dot(n, V3f(v[0].x, v[0].y, 0)), 0) << shape;
        EXPECT_GT(dot(n, mesh.normals[0][mesh.indices[3 * (mesh.triangleCount() / 2)]]), 0) << shape;
    }
}

/// Spheres and disks with alpha are triangles on the same surface, with the same texture coordinates.
TEST(CompatPlugin, SpheresAndDisksWithAlphaAreMeshes) {
    const std::string mask = R"(Texture "mask" "float" "checkerboard" "float uscale" 8 "float vscale" 8
)";
    EXPECT_LT(deviation(mask + R"(Shape "sphere" "float radius" 2 "texture alpha" "mask" )",
                        [](const V3f& p) { return std::sqrt(length2(p)) - 2; }),
              1e-5f);
    EXPECT_LT(deviation(mask + R"(Shape "disk" "float height" 3 "texture alpha" "mask" )",
                        [](const V3f& p) { return p.z - 3; }),
              1e-6f);
    const std::string uv = R"(Texture "uv" "spectrum" "uv" Material "matte" "texture Kd" "uv" )";
    for (const char* shape :
         {R"(Shape "sphere" "float zmin" -.3 "float phimax" 270 )",
          R"(Shape "disk" "float radius" 1.2 "float innerradius" .2 "float phimax" 300 )"}) {
        const Image exact = load(kV4 + kLit + uv + shape).image;
        const Image mesh = load(kV4 + kLit + uv + shape + R"("float alpha" 1 )").image;
        double difference = 0, sum = 0;
        for (size_t i = 0; i < exact.pixels.size(); ++i) {
            difference += std::abs(exact.pixels[i].y - mesh.pixels[i].y);
            sum += exact.pixels[i].y;
        }
        EXPECT_LT(difference, .02 * sum) << shape;
    }
}

/// Lamps with alpha 0 illuminate as visible ones do: rays do not hit them, so that light samples alone count.
/// Of a sphere, pbrt samples the near side only, also if both sides emit.
TEST(CompatPlugin, InvisibleLampsIlluminate) {
    constexpr int kSeeds = 16;
    std::vector<std::string> messages;
    const auto light = [&](const std::string& shape, const std::string& twoSided) {
        Diagnostics diagnostics(
            [&](const std::string& text) { messages.push_back(text.substr(0, text.find('\n'))); });
        const std::string text = kView +
                                 R"(Integrator "directlighting" WorldBegin Shape "disk" "float radius" 3 )" +
                                 R"(AttributeBegin AreaLightSource "diffuse" "rgb L" [1 1 1] )" + twoSided +
                                 shape + " AttributeEnd";
        return test::meanOverSeeds(
            buildScene(parseText(text, "test.pbrt", {"supersample"}, diagnostics), {}, diagnostics), kSeeds);
    };
    const auto expectEqual = [&](const test::Estimate& a, const test::Estimate& b) {
        EXPECT_GT(a.mean, .05);
        EXPECT_LT(a.error, .01 * a.mean);
        EXPECT_LT(std::abs(a.mean - b.mean), test::criticalZ(3, kSeeds) * std::hypot(a.error, b.error));
    };
    const std::string both = R"("bool twosided" true )", invisible = R"("float alpha" 0 )";
    const std::string ceiling =
        R"(Shape "trianglemesh" "point3 P" [-9 -9 3  9 -9 3  -9 9 3  9 9 3] "integer indices" [0 2 1 1 2 3] )";
    const std::string ball = R"(Translate 0 0 9 Shape "sphere" "float radius" 4 )";
    expectEqual(light(ceiling, ""), light(ceiling + invisible, ""));
    expectEqual(light(ceiling, ""), light(ceiling + invisible, both));
    EXPECT_EQ(messages, std::vector<std::string>{});
    expectEqual(light(ball, both), light(ball + invisible, both));
    EXPECT_EQ(messages,
              std::vector<std::string>{
                  "test.pbrt:5:164: note: shape \"sphere\" is not supported; it is converted to triangles"});
}

/// The name of a .pbrt file of test/loader/compat/exporters.
class Exporters : public testing::TestWithParam<const char*> {};

TEST_P(Exporters, LoadWithExpectedWarnings) {
    const fs::path folder = fs::path(STROBE_SOURCE_DIR) / "test/loader/compat/exporters";
    std::string warnings;
    Diagnostics diagnostics([&](const std::string& formatted) {
        std::string line = formatted.substr(0, formatted.find('\n')) + "\n";
        const std::string prefix = folder.string() + "/";
        if (const size_t begin = line.find(prefix); begin != std::string::npos)
            line.erase(begin, prefix.size());
        warnings += line;
    });
    const fs::path file = folder / (std::string(GetParam()) + ".pbrt");
    const Image image =
        test::render(buildScene(parseFiles({file}, {"supersample"}, diagnostics), {}, diagnostics)).image;
    std::ifstream expected(folder / (std::string(GetParam()) + ".warnings"));
    EXPECT_EQ(warnings, std::string(std::istreambuf_iterator<char>(expected), {}));
    double mean = 0;
    for (const Rgb& c : image.pixels)
        mean += luminance(c) / double(image.pixels.size());
    EXPECT_GT(mean, .02);
    EXPECT_LT(mean, 20);
}

INSTANTIATE_TEST_SUITE_P(CompatPlugin, Exporters,
                         testing::Values("blender-v3", "cinema-v2", "converter-v4", "houdini-v3", "studio-v4",
                                         "plugins-v2"));

} // namespace
} // namespace strobe
