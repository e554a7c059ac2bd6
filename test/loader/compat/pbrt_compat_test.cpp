// What other programs write: each construct becomes the nearest of ours, and a warning says so once.
#include "support/render_text.h"
#include "support/scene_files.h"

#include <gtest/gtest.h>

#include <fstream>

namespace strobe {
namespace {

namespace fs = std::filesystem;

const std::string kView = "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\n"
                          "Sampler \"sobol\" \"integer pixelsamples\" 16\n"
                          "LookAt 0 -4 2  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 40\n";
const std::string kV4 = kView + "Integrator \"path\"\n", kV2 = kView + "SurfaceIntegrator \"path\"\n";
const std::string kLit = "WorldBegin\nLightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n"
                         "LightSource \"point\" \"rgb I\" [9 8 7] \"point from\" [2 -3 3]\n";
const std::string kLitV2 = "WorldBegin\nLightSource \"infinite\" \"color L\" [.5 .6 .7]\n"
                           "LightSource \"point\" \"color I\" [9 8 7] \"point from\" [2 -3 3]\n";
const std::string kBall = "Shape \"sphere\"\n";

struct Loaded {
    Image image;
    std::vector<std::string> warnings; ///< first lines, from "warning: " on
};

Loaded load(const std::string& text, const std::string& name = "test.pbrt") {
    Loaded loaded;
    Diagnostics messages([&](const std::string& formatted) {
        const std::string line = formatted.substr(0, formatted.find('\n'));
        loaded.warnings.push_back(line.substr(line.find("warning: ") + 9));
    });
    loaded.image =
        test::render(buildScene(parseText(text, name, {"supersample"}, messages), {}, messages)).image;
    return loaded;
}

bool equal(const Image& a, const Image& b) {
    return std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), b.pixels.end());
}

struct Pair {
    const char* theirs;
    const char* ours;
    const char* warning; ///< empty: there is none
};

class Materials : public testing::TestWithParam<Pair> {};

TEST_P(Materials, OfVersions3And4BecomeTheNearest) {
    const Pair& pair = GetParam();
    const std::string floor = "Shape \"disk\" \"float radius\" 3 \"float height\" -1\n";
    const Loaded theirs =
        load(kV4 + kLit + "Material " + pair.theirs + kBall + floor + "Material " + pair.theirs);
    const Loaded ours = load(kV4 + kLit + "Material " + pair.ours + kBall + floor);
    EXPECT_TRUE(equal(theirs.image, ours.image));
    if (*pair.warning)
        EXPECT_EQ(theirs.warnings, std::vector<std::string>{pair.warning});
    else
        EXPECT_TRUE(theirs.warnings.empty());
    EXPECT_GT(luminance(theirs.image.at(8, 8)), .01f);
}

const char* const kBecomesGloss = "\" is not supported; \"metallicroughness\" takes its place";
std::string gloss(const char* name) { return std::string("material \"") + name + kBecomesGloss; }

// Roughness r of metallicroughness has alpha = r².
const std::string kCoatedWarning = gloss("coateddiffuse"), kConductorWarning = gloss("conductor"),
                  kPlasticWarning = gloss("plastic"), kSubstrateWarning = gloss("substrate"),
                  kDisneyWarning = gloss("disney"), kThinWarning = gloss("thindielectric"),
                  kCoatedConductorWarning = gloss("coatedconductor"),
                  kUberWarning =
                      "material \"uber\" is not supported; its heaviest lobes take its place, as \"plastic\" "
                      "(pbrt-v2), \"metallicroughness\" or \"glass\"",
                  kTranslucentWarning =
                      "material \"translucent\" is not supported; \"matte\" takes its place, reflecting what "
                      "would go through",
                  kFourierWarning = "material \"fourier\" is not supported; a gray \"matte\" takes its place",
                  kHairWarning = "material \"hair\" is not supported; \"matte\" takes its place";

INSTANTIATE_TEST_SUITE_P(
    CompatPlugin, Materials,
    testing::Values(
        Pair{"\"diffuse\" \"rgb reflectance\" [.7 .2 .1]\n", "\"matte\" \"rgb Kd\" [.7 .2 .1]\n", ""},
        Pair{"\"dielectric\" \"float eta\" 1.3\n", "\"glass\" \"float index\" 1.3\n", ""},
        Pair{"\"coateddiffuse\" \"rgb reflectance\" [.7 .2 .1] \"float roughness\" .0625 \"float eta\" 1.4\n",
             "\"metallicroughness\" \"rgb basecolor\" [.7 .2 .1] \"float metallic\" 0 \"float roughness\" .5 "
             "\"float ior\" 1.4\n",
             kCoatedWarning.c_str()},
        Pair{"\"coateddiffuse\" \"rgb reflectance\" [.7 .2 .1] \"float roughness\" .25 \"bool "
             "remaproughness\" false\n",
             "\"metallicroughness\" \"rgb basecolor\" [.7 .2 .1] \"float metallic\" 0 \"float roughness\" "
             ".5\n",
             kCoatedWarning.c_str()},
        Pair{"\"conductor\" \"rgb reflectance\" [.9 .8 .5] \"float uroughness\" .0625 \"float vroughness\" "
             ".0625\n",
             "\"metallicroughness\" \"rgb basecolor\" [.9 .8 .5] \"float roughness\" .5\n",
             kConductorWarning.c_str()},
        Pair{"\"conductor\" \"rgb eta\" [1 1 1] \"rgb k\" [2 2 2] \"float roughness\" .0625\n", // k²/(4+k²)
             "\"metallicroughness\" \"rgb basecolor\" [.5 .5 .5] \"float roughness\" .5\n",
             kConductorWarning.c_str()},
        Pair{"\"coatedconductor\" \"rgb reflectance\" [.9 .8 .5] \"float conductor.roughness\" .0625 \"float "
             "interface.roughness\" 0\n",
             "\"metallicroughness\" \"rgb basecolor\" [.9 .8 .5] \"float roughness\" .5 \"float clearcoat\" "
             "1\n",
             kCoatedConductorWarning.c_str()},
        Pair{"\"plastic\" \"rgb Kd\" [.7 .2 .1] \"rgb Ks\" [.5 .5 .5] \"float roughness\" .25 \"bool "
             "remaproughness\" false\n",
             "\"metallicroughness\" \"rgb basecolor\" [.7 .2 .1] \"float metallic\" 0 \"float roughness\" .5 "
             "\"float specular\" .5\n",
             kPlasticWarning.c_str()},
        Pair{"\"substrate\" \"rgb Kd\" [.7 .2 .1] \"rgb Ks\" [.04 .04 .04] \"float uroughness\" .25 \"float "
             "vroughness\" .25 \"bool remaproughness\" false\n",
             "\"metallicroughness\" \"rgb basecolor\" [.7 .2 .1] \"float metallic\" 0 \"float roughness\" "
             ".5\n",
             kSubstrateWarning.c_str()},
        Pair{"\"uber\" \"rgb Kd\" [.1 .1 .1] \"rgb Kt\" [.8 .9 .8] \"rgb Kr\" [1 1 1] \"float eta\" 1.3\n",
             "\"glass\" \"rgb Kt\" [.8 .9 .8] \"float eta\" 1.3\n", kUberWarning.c_str()},
        Pair{
            "\"uber\" \"rgb Kd\" [.7 .2 .1] \"rgb Ks\" [0 0 0] \"rgb Kr\" [1 1 1]\n",
            "\"metallicroughness\" \"rgb basecolor\" [.7 .2 .1] \"float metallic\" 0 \"float roughness\" 0\n",
            kUberWarning.c_str()},
        Pair{"\"disney\" \"rgb color\" [.7 .2 .1] \"float metallic\" .5 \"float roughness\" .4 \"float eta\" "
             "1.4\n",
             "\"metallicroughness\" \"rgb basecolor\" [.7 .2 .1] \"float metallic\" .5 \"float roughness\" "
             ".4 \"float ior\" 1.4\n",
             kDisneyWarning.c_str()},
        Pair{"\"thindielectric\" \"float eta\" 1.4\n",
             "\"metallicroughness\" \"float metallic\" 0 \"float roughness\" 0 \"float ior\" 1.4 \"float "
             "transmission\" 1\n",
             kThinWarning.c_str()},
        Pair{"\"translucent\" \"rgb Kd\" [.5 .5 .25] \"rgb reflect\" [.5 .5 .5] \"rgb transmit\" [.25 .25 "
             ".25]\n",
             "\"matte\" \"rgb Kd\" [.375 .375 .1875]\n", kTranslucentWarning.c_str()},
        Pair{"\"hair\" \"rgb color\" [.5 .3 .1]\n", "\"matte\" \"rgb Kd\" [.5 .3 .1]\n",
             kHairWarning.c_str()},
        Pair{"\"fourier\" \"string bsdffile\" \"x.bsdf\"\n", "\"matte\"\n", kFourierWarning.c_str()}));

TEST(CompatPlugin, UberOfVersion2IsPlastic) {
    const std::string lobes = " \"color Kd\" [.4 .3 .2] \"color Ks\" [.5 .4 .3] \"float roughness\" .05\n";
    EXPECT_TRUE(equal(load(kV2 + kLitV2 + "Material \"uber\"" + lobes + kBall).image,
                      load(kV2 + kLitV2 + "Material \"plastic\"" + lobes + kBall).image));
}

TEST(CompatPlugin, RoughnessOfVersion3GoesThroughItsPolynomial) {
    // The polynomial at roughness 1 is its constant, 1.62, more than GGX allows: alpha 1.
    const std::string color = " \"rgb Kd\" [.4 .3 .2] \"rgb Ks\" [1 1 1]";
    EXPECT_TRUE(equal(
        load(kV4 + kLit + "Material \"plastic\"" + color + " \"float roughness\" 1\n" + kBall).image,
        load(kV4 + kLit +
             "Material \"metallicroughness\" \"rgb basecolor\" [.4 .3 .2] \"float metallic\" 0\n" + kBall)
            .image));
}

TEST(CompatPlugin, TexturedInputsAreCarriedOver) {
    const auto board = [](const std::string& name, const std::string& type, const std::string& values) {
        return "Texture \"" + name + "\" \"" + type + "\" \"checkerboard\" \"float uscale\" 8 " + values +
               " \"string aamode\" \"none\"\n"; // unfiltered: a mean of roots is not the root of a mean
    };
    const std::string textures =
        kV4 + kLit + board("color", "spectrum", "\"rgb tex1\" [.9 .1 .1] \"rgb tex2\" [.1 .1 .9]") +
        board("alpha", "float", "\"float tex1\" .0625 \"float tex2\" 1") +
        board("root", "float", "\"float tex1\" .5 \"float tex2\" 1");
    EXPECT_TRUE(equal(load(textures +
                           "Material \"coateddiffuse\" \"texture reflectance\" \"color\" "
                           "\"texture roughness\" \"alpha\"\n" +
                           kBall)
                          .image,
                      load(textures +
                           "Material \"metallicroughness\" \"texture basecolor\" \"color\" "
                           "\"texture roughness\" \"root\" \"float metallic\" 0\n" +
                           kBall)
                          .image));
}

TEST(CompatPlugin, MixIsItsHeavierPart) {
    const std::string two = "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [.8 .1 .1]\n"
                            "MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [.1 .1 .8]\n";
    const Image a = load(kV4 + kLit + two + "NamedMaterial \"a\"\n" + kBall).image;
    const Image b = load(kV4 + kLit + two + "NamedMaterial \"b\"\n" + kBall).image;
    const auto mix = [&](const std::string& parameters) {
        const Loaded loaded = load(kV4 + kLit + two + "Material \"mix\" " + parameters + kBall);
        EXPECT_EQ(loaded.warnings,
                  std::vector<std::string>{
                      "material \"mix\" is not supported; the heavier of its two takes its place"});
        return loaded.image;
    };
    const std::string v3 = "\"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" ";
    EXPECT_TRUE(equal(mix(v3 + "\"rgb amount\" [.7 .7 .7]\n"), a)); // of the first
    EXPECT_TRUE(equal(mix(v3 + "\"rgb amount\" [.3 .3 .3]\n"), b));
    EXPECT_TRUE(equal(mix("\"string materials\" [\"a\" \"b\"] \"float amount\" .7\n"), b)); // of the second
    EXPECT_TRUE(equal(mix("\"string materials\" [\"a\" \"b\"] \"float amount\" .3\n"), a));
}

TEST(CompatPlugin, BoundariesOfMediaAreLeftOutUnlessTheyShine) {
    const std::string floor = "Shape \"disk\" \"float radius\" 3 \"float height\" -1\n";
    for (const char* name : {"", "none", "interface"}) {
        const std::string material = std::string("Material \"") + name + "\"\n";
        EXPECT_TRUE(equal(load(kV4 + kLit + floor + material + kBall).image, load(kV4 + kLit + floor).image))
            << name;
        const std::string shining = "AreaLightSource \"diffuse\" \"rgb L\" [2 2 2]\n" + kBall;
        EXPECT_TRUE(equal(load(kV4 + kLit + material + shining).image,
                          load(kV4 + kLit + "Material \"matte\" \"rgb Kd\" [0 0 0]\n" + shining).image))
            << name;
    }
}

TEST(CompatPlugin, OpacityOfUberIsTheAlphaOfItsMeshes) {
    const std::string mesh =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-1 0 -1  1 0 -1  0 0 1]";
    const std::string uber = "Material \"uber\" \"rgb Ks\" [0 0 0] \"rgb opacity\" ";
    EXPECT_TRUE(equal(load(kV4 + kLit + uber + "[.3 .3 .3]\n" + mesh).image,
                      load(kV4 + kLit + uber + "[1 1 1]\n" + mesh + " \"float alpha\" .3\n").image));
    EXPECT_FALSE(equal(load(kV4 + kLit + uber + "[.3 .3 .3]\n" + mesh).image,
                       load(kV4 + kLit + uber + "[1 1 1]\n" + mesh).image));
}

TEST(CompatPlugin, FilmsFactorsAreThoseOfTheLight) {
    const auto scene = [](const std::string& film, const std::string& scale) {
        std::string text = kV4;
        text.insert(text.find('\n'), film);
        return text + "WorldBegin\nLightSource \"infinite\" \"rgb L\" [.5 .6 .7] \"float scale\" " + scale +
               "\nAreaLightSource \"diffuse\" \"float scale\" " + scale + "\n" + kBall;
    };
    const Image twice = load(scene("", "2")).image;
    EXPECT_TRUE(equal(load(scene(" \"float scale\" 2", "1")).image, twice));
    EXPECT_TRUE(equal(load(scene(" \"float iso\" 400 \"float exposuretime\" .5", "1")).image, twice));
}

TEST(CompatPlugin, TotalsOfLights) {
    const auto lit = [](const std::string& light) {
        return load(kV4 + "WorldBegin\n" + light + kBall).image;
    };
    const auto near = [](const Image& a, const Image& b) {
        for (size_t i = 0; i < a.pixels.size(); ++i)
            EXPECT_NEAR(a.pixels[i].x, b.pixels[i].x, 1e-4f * (1 + b.pixels[i].x)) << i;
        EXPECT_GT(b.at(8, 8).x, .01f);
    };
    const std::string from = " \"point3 from\" [0 -3 1]\n";
    near(lit("LightSource \"point\" \"float power\" 100" + from),
         lit("LightSource \"point\" \"rgb I\" [7.9577472 7.9577472 7.9577472]" + from));
    near(lit("LightSource \"distant\" \"float illuminance\" 3" + from),
         lit("LightSource \"distant\" \"rgb L\" [3 3 3]" + from));
    near(lit("LightSource \"infinite\" \"float illuminance\" 3.1415927\n"),
         lit("LightSource \"infinite\"\n"));
    const std::string area = "Translate 0 0 2\nReverseOrientation\nAreaLightSource \"diffuse\" ",
                      disk = "\nShape \"disk\" \"float radius\" 2\n";
    near(lit("AttributeBegin\n" + area + "\"float power\" 39.4784176" + disk + "AttributeEnd\n"),
         lit("AttributeBegin\n" + area + "\"rgb L\" [1 1 1]" + disk + "AttributeEnd\n")); // π · 4π
}

TEST(CompatPlugin, TrifleInAPbrtFileIsAWarning) {
    const auto warning = [](const std::string& text) {
        const Loaded loaded = load(kV4 + kLit + kBall + text);
        return loaded.warnings.size() == 1 ? loaded.warnings[0]
                                           : "not one warning, but " + std::to_string(loaded.warnings.size());
    };
    EXPECT_EQ(warning("Translate 1, 2, 0\nTranslate 1, 0, 0\n"), "commas between numbers are read as blanks");
    EXPECT_EQ(warning("Texture \"a, b\" \"float\" \"constant\" # c, d\n"), "not one warning, but 0");
    EXPECT_EQ(warning("Shape \"sphere\" \"float radius\" .1 \"float radius\" .2\nShape \"sphere\" \"float "
                      "radius\" .1 \"float radius\" .2\n"),
              "parameter \"radius\" is given twice; the last counts");
    EXPECT_EQ(warning("NamedMaterial \"lost\"\n"), "unknown material \"lost\": its shapes are matte");
    EXPECT_EQ(warning("ObjectInstance \"lost\"\nObjectInstance \"lost\"\n"),
              "unknown object \"lost\": its instances are left out");
    EXPECT_EQ(warning("Material \"matte\" \"texture Kd\" \"lost\"\n"),
              "unknown texture \"lost\": what it would be for keeps its default");
    EXPECT_EQ(warning("Material \"carpaint\" \"rgb color\" [1 1 1]\n"),
              "material \"carpaint\" is not known; \"matte\" takes its place");
    EXPECT_EQ(warning("Shape \"teapot\" \"float size\" 2\n"),
              "shape \"teapot\" is not known; it is left out");
    EXPECT_EQ(warning("AttributeBegin\nAreaLightSource \"portal\"\nShape \"sphere\"\nAttributeEnd\n"),
              "area light \"portal\" is not known; it is left out");
    EXPECT_EQ(warning("AttributeBegin\nObjectBegin \"o\"\nAttributeEnd\nShape \"sphere\"\nObjectEnd\n"),
              "AttributeEnd comes before the end of ObjectBegin (test.pbrt:11:1): what was saved last is "
              "restored first");
    EXPECT_EQ(warning("LightSource \"laser\" \"float size\" 2\n"),
              "light \"laser\" is not known; it is left out");
    EXPECT_EQ(warning("Shape \"trianglemesh\" \"point P\" [] \"integer indices\" []\n"),
              "a mesh without triangles is ignored");
    EXPECT_EQ(warning("Material \"matte\" \"float bumpmap\" 1\nMaterial \"glass\" \"float bumpmap\" 1\n"),
              "bump, displacement and normal maps are not supported: surfaces stay smooth");
    EXPECT_EQ(warning("Shape \"sphere\" \"float sheen\" 1\nShape \"sphere\" \"float sheen\" 1\n"),
              "parameter \"sheen\" is ignored (known: radius, zmin, zmax, phimax, name)");
}

TEST(CompatPlugin, EveryWayToPickALightIsOne) {
    const auto with = [](const std::string& strategy) {
        return load(kView + "Integrator \"path\" \"string lightsamplestrategy\" \"" + strategy + "\"\n" +
                    kLit + kBall);
    };
    const Loaded one = with("one"), unknown = with("photontree");
    EXPECT_FALSE(equal(one.image, with("all").image));
    EXPECT_TRUE(equal(one.image, with("spatial").image));
    EXPECT_TRUE(one.warnings.empty());
    EXPECT_TRUE(equal(one.image, unknown.image));
    EXPECT_EQ(unknown.warnings,
              std::vector<std::string>{
                  "\"strategy\" must be \"all\" or \"one\", not \"photontree\"; \"one\" takes its place"});
}

TEST(CompatPlugin, TrifleInASceneFileIsAnError) {
    for (const char* text :
         {"Translate 1, 2, 0\n", "Shape \"sphere\" \"float radius\" 1 \"float radius\" 2\n",
          "NamedMaterial \"lost\"\n", "ObjectInstance \"lost\"\n", "Material \"carpaint\"\n",
          "Shape \"teapot\"\n", "AttributeBegin\nObjectBegin \"o\"\nAttributeEnd\nObjectEnd\n",
          "Material \"matte\" \"float bumpmap\" 1\n",
          "Shape \"trianglemesh\" \"point P\" [] \"integer indices\" []\n"})
        EXPECT_THROW(load(kV4 + kLit + text, "test.scene"), Error) << text;
}

/// The largest distance of the mesh's vertices from what `distance` is zero on.
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
    EXPECT_LT(deviation("Shape \"cylinder\" \"float radius\" 2\n", [&](const V3f& p) { return r(p) - 2; }),
              1e-5f);
    EXPECT_LT(deviation("Shape \"cone\" \"float radius\" 2 \"float height\" 4\n",
                        [&](const V3f& p) { return r(p) - (4 - p.z) / 2; }),
              1e-5f);
    EXPECT_LT(deviation("Shape \"paraboloid\" \"float radius\" 2 \"float zmax\" 4\n",
                        [&](const V3f& p) { return r(p) * r(p) - p.z; }),
              1e-5f);
    EXPECT_LT(
        deviation("Shape \"hyperboloid\" \"point3 p1\" [1 0 -1] \"point3 p2\" [1 2 1]\n", // r² = 1 + (1 + z)²
                  [&](const V3f& p) { return r(p) * r(p) - 1 - (1 + p.z) * (1 + p.z); }),
        1e-5f);
    EXPECT_LT(deviation("Shape \"bilinearmesh\" \"point3 P\" [0 0 1  1 0 1  0 1 1  1 1 1]\n",
                        [](const V3f& p) { return p.z - 1; }),
              1e-6f);
    EXPECT_LT(deviation("Shape \"curve\" \"point3 P\" [0 0 0  0 0 1  0 0 2  0 0 3] \"float width\" .2\n",
                        [&](const V3f& p) { return r(p) - .1f; }),
              1e-5f);
    EXPECT_LT(deviation("Shape \"curve\" \"string basis\" \"bspline\" \"point3 P\" [0 0 0  0 0 1  0 0 2  0 0 "
                        "3  0 0 4] \"float width\" .2\n",
                        [&](const V3f& p) { return std::max(r(p) - .1f, std::abs(p.z - 2) - 1); }),
              1e-5f);
}

TEST(CompatPlugin, ShapesFaceOutwards) {
    for (const char* shape : {"Shape \"cylinder\"\n", "Shape \"paraboloid\"\n"}) {
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

/// The warnings of a file of test/loader/compat/exporters.
class Exporters : public testing::TestWithParam<const char*> {};

TEST_P(Exporters, LoadWithTheWarningsThatAreExpected) {
    const fs::path folder = fs::path(STROBE_SOURCE_DIR) / "test/loader/compat/exporters";
    std::string told;
    Diagnostics messages([&](const std::string& formatted) {
        std::string line = formatted.substr(0, formatted.find('\n')) + "\n";
        if (const size_t at = line.find(folder.string() + "/"); at != std::string::npos)
            line.erase(at, folder.string().size() + 1);
        told += line;
    });
    const fs::path file = folder / (std::string(GetParam()) + ".pbrt");
    const Image image =
        test::render(buildScene(parseFiles({file}, {"supersample"}, messages), {}, messages)).image;
    std::ifstream expected(folder / (std::string(GetParam()) + ".warnings"));
    EXPECT_EQ(told, std::string(std::istreambuf_iterator<char>(expected), {}));
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
