// The messages of scenes that parse but cannot be built.
#include "support/render_text.h"
#include "support/scene_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using test::formatted;
using test::MessageCase;

/// The messages of building a scene.
struct Outcome {
    std::string error; ///< formatted; empty: none
    std::vector<std::string> warnings;
};

Outcome outcomeOf(const std::string& text, const std::filesystem::path& name = "t.scene",
                  const BuildOptions& options = {}) {
    Outcome outcome;
    Diagnostics diagnostics([&](const std::string& m) { outcome.warnings.push_back(m); });
    try {
        buildScene(parseText(text, name, {"supersample"}, diagnostics), options, diagnostics);
    } catch (const Error& e) {
        outcome.error = formatDiagnostic(e.location, "error", e.what());
    }
    return outcome;
}

/// Returns the names of a plugin table as messages list them.
template <class Row>
std::string namesOf(const std::vector<Row>& table) {
    std::string names;
    for (const Row& row : table)
        names += (names.empty() ? "" : ", ") + row.name;
    return names;
}

/// Returns the end of the message about an unknown name in a plugin table.
template <class Row>
std::string known(const std::vector<Row>& table) {
    return " (known: " + namesOf(table) + ")";
}

/// Returns the end of the message about an unknown name of an integrator or shader.
std::string knownIntegrators(const PluginTables& tables) {
    return " (known: " + namesOf(tables.integrators) + "; for shading: " + namesOf(tables.shaders) + ")";
}

void expectErrors(const std::vector<MessageCase>& cases) {
    for (const MessageCase& expected : cases)
        EXPECT_EQ(outcomeOf(expected.text).error, formatted(expected)) << expected.text;
}

TEST(BuildErrors, Options) {
    const PluginTables tables = pluginTables();
    expectErrors({
        {R"(Film "image" "integer xresolution" 0
WorldBegin)",
         1, 14, R"("xresolution" must be between 1 and 65536, not 0)"},
        {R"(Film "image" "float xresolution" 8
WorldBegin)",
         1, 14, R"(parameter "xresolution" must be integer, not float)"},
        {R"(Film "image" "integer xresolution" [8 8]
WorldBegin)",
         1, 14, R"(parameter "xresolution" needs 1 value, got 2)"},
        {R"(Film "image" "integer yresolution" 70000
WorldBegin)",
         1, 14, R"("yresolution" must be between 1 and 65536, not 70000)"},
        {R"(Film "image" "float cropwindow" [.5 .5 0 1]
WorldBegin)",
         1, 14, R"("cropwindow" needs four numbers x0 x1 y0 y1 with x0 < x1 and y0 < y1)"},
        {R"(Film "image" "integer pixelbounds" [0 10 9]
WorldBegin)",
         1, 14, R"("pixelbounds" needs four integers x0 x1 y0 y1 with x0 < x1 and y0 < y1)"},
        {R"(Film "imgae"
WorldBegin)",
         1, 1, R"(unknown film "imgae"; did you mean "image"?)" + known(tables.films)},
        {R"(Camera "fisheye"
WorldBegin)",
         1, 1, R"(unknown camera "fisheye")" + known(tables.cameras)},
        {R"(Camera "perspective" "float fov" 180
WorldBegin)",
         1, 22, R"(the field of view must be above 0 and below 180 degrees)"},
        {R"(Camera "perspective" "float shutteropen" 1 "float shutterclose" 0
WorldBegin)",
         1, 44, R"(the shutter closes before it opens)"},
        {R"(Camera "perspective" "float lensradius" -1
WorldBegin)",
         1, 22, R"("lensradius" must not be negative)"},
        {R"(Camera "orthographic" "float screenwindow" [1 1 0 1]
WorldBegin)",
         1, 23, R"("screenwindow" is empty)"},
        {R"(Sampler "sobole"
WorldBegin)",
         1, 1, R"(unknown sampler "sobole"; did you mean "sobol"?)" + known(tables.samplers)},
        {R"(Sampler "sobol" "integer pixelsamples" 0
WorldBegin)",
         1, 17, R"("pixelsamples" must be at least 1)"},
        {R"(Sampler "stratified" "integer xsamples" -2
WorldBegin)",
         1, 22, R"("xsamples" must be at least 1)"},
        {R"(PixelFilter "gausian"
WorldBegin)",
         1, 1, R"(unknown pixel filter "gausian"; did you mean "gaussian"?)" + known(tables.filters)},
        {R"(PixelFilter "box" "float xwidth" 0
WorldBegin)",
         1, 19, R"("xwidth" must be positive)"},
        {R"(Integrator "pathh"
WorldBegin)",
         1, 1, R"(unknown integrator "pathh"; did you mean "path"?)" + knownIntegrators(tables)},
        {R"(Integrator "msa"
WorldBegin)",
         1, 1, R"(unknown integrator "msa"; did you mean "msaa"?)" + knownIntegrators(tables)},
        {R"(Integrator "path" "integer maxdepth" -1
WorldBegin)",
         1, 19, R"("maxdepth" must not be negative)"},
        {R"(Integrator "path" "string strategy" "some"
WorldBegin)",
         1, 19,
         R"("strategy" must be "auto", "all", "weighted", "one", "power", "uniform", "tree", "bvh", "spatial", "exhaustive"; not "some")"},
        {R"(Film "image" "float cropwindow" [2 3 0 1]
WorldBegin)",
         1, 1, R"(the crop window contains no pixels)"},
        {R"(Film "image" "integer pixelbounds" [0 10 900 910]
WorldBegin)",
         1, 1, R"(the crop window contains no pixels)"},
        {R"(Integrator "path" "float maxdepth" 3
WorldBegin)",
         1, 19, R"(parameter "maxdepth" must be integer, not float)"},
    });
}

TEST(BuildErrors, Shapes) {
    const PluginTables tables = pluginTables();
    expectErrors({
        {R"(WorldBegin
Shape "sphere" "float raduis" 2)",
         2, 16,
         R"(unknown parameter "raduis"; did you mean "radius"? (known: radius, zmin, zmax, phimax, name))"},
        {R"(WorldBegin
Shape "sphre")",
         2, 1, R"(unknown shape "sphre"; did you mean "sphere"?)" + known(tables.shapes)},
        {R"(WorldBegin
Shape "sphere" "float radius" -1)",
         2, 16, R"("radius" must be positive and finite)"},
        {R"(WorldBegin
Shape "sphere" "float zmin" 2)",
         2, 16, R"("zmin" and "zmax" leave nothing of the sphere)"},
        {R"(WorldBegin
Shape "disk" "float innerradius" 1)",
         2, 14, R"("innerradius" must be at least 0 and less than "radius")"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 3])",
         2, 52, R"(index 3 (number 2 of "indices", in triangle 0) is out of range: the mesh has 3 vertices)"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 -1])",
         2, 52,
         R"(index -1 (number 2 of "indices", in triangle 0) is out of range: the mesh has 3 vertices)"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2 0])",
         2, 52, R"("indices" has 4 numbers, which is not a multiple of 3)"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0 1 1 1])",
         2, 1, R"(parameter "indices" is missing (it is optional only for exactly 3 vertices; there are 4))"},
        {R"(WorldBegin
Shape "trianglemesh" "integer indices" [0 1 2])",
         2, 1, R"(parameter "P" is missing)"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "normal N" [0 0 1])",
         2, 52, R"("N" has 1 normal, but the mesh has 3 vertices)"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "float uv" [0 0 1])",
         2, 52, R"(parameter "uv" needs a multiple of 2 numbers, got 3)"},
        {R"(WorldBegin
Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "integer keys" 2)",
         2, 22, R"("P" has 3 points, which do not divide into 2 keys)"},
        {R"(WorldBegin
Shape "plymesh")",
         2, 1, R"(parameter "filename" is missing)"},
        {R"(WorldBegin
Shape "loopsubdiv" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 5])",
         2, 50, R"(index 5 (number 2 of "indices", in triangle 0) is out of range: the mesh has 3 vertices)"},
        {R"(WorldBegin
Shape "loopsubdiv" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2] "integer nlevels" 99)",
         2, 76, R"("nlevels" must be between 0 and 8, not 99)"},
        {R"(TransformTimes 0 1
WorldBegin
Shape "trianglemesh" "integer keys" 2 "point P" [0 0 0 1 0 0 0 1 0 0 0 0 1 0 0 0 1 0] "float keytimes" [1 0])",
         3, 87, R"("keytimes" must be finite and ascending; number 1 is not)"},
    });
}

TEST(BuildErrors, Lights) {
    const PluginTables tables = pluginTables();
    expectErrors({
        {R"(WorldBegin
AreaLightSource "diffuse" "rgb L" [1 1 1]
Shape "trianglemesh" "point P" [0 0 0 1 0 0 2 0 0])",
         2, 1, R"(area light on a shape of zero area)"},
        {R"(WorldBegin
AreaLightSource "diffuse" "rgb L" [1 1 1]
Scale 1 0 1
Shape "sphere")",
         3, 1, R"(Scale factors must not be zero, or too large or too small to invert)"},
        {R"(WorldBegin
AreaLightSource "difuse" "rgb L" [1 1 1]
Shape "sphere")",
         2, 1, R"(unknown area light "difuse"; did you mean "diffuse"?)" + known(tables.areaLights)},
        {R"(WorldBegin
AreaLightSource "diffuse" "float L" 1
Shape "sphere")",
         2, 27, R"(parameter "L" must be rgb or spectrum or blackbody, not float)"},
        {R"(WorldBegin
AreaLightSource "diffuse" "integer nsamples" 0
Shape "sphere")",
         2, 27, R"("nsamples" must be at least 1)"},
        {R"(WorldBegin
AreaLightSource "diffuse" "integer nsamples" 65537
Shape "sphere")",
         2, 27, R"("nsamples" must be at most 65536)"},
        {R"(WorldBegin
AreaLightSource "diffuse" "rgb L" [1 -1 1]
Shape "sphere")",
         2, 27, R"("L" must be finite and not negative)"},
        {R"(WorldBegin
LightSource "lamp")",
         2, 1, R"(unknown light "lamp")" + known(tables.lights)},
        {R"(WorldBegin
LightSource "infinite" "string mapname" "none.exr")",
         2, 24, R"(file "none.exr" not found; looked for "none.exr")"},
        {R"(WorldBegin
LightSource "distant" "point from" [1 1 1] "point to" [1 1 1])",
         2, 44, R"("from" and "to" are the same point)"},
        {R"(WorldBegin
LightSource "spot" "float coneangle" 0)",
         2, 20, R"("coneangle" must be above 0 and at most 180 degrees)"},
        {R"(WorldBegin
LightSource "spot" "string falloff" "quadratic")",
         2, 20,
         R"(unknown falloff "quadratic"; did you mean "quartic"? (known: quartic, smoothstep, squared))"},
        {R"(WorldBegin
ObjectBegin "o"
AreaLightSource "diffuse"
Shape "trianglemesh" "point P" [0 0 0 0 0 0 0 1 0]
ObjectEnd
ObjectInstance "o")",
         3, 1, R"(area light on a shape of zero area)"},
    });
}

TEST(BuildErrors, MaterialsAndTextures) {
    const PluginTables tables = pluginTables();
    expectErrors({
        {R"(WorldBegin
Material "matte" "rgb Kd" [.5 .5 .5]
Shape "sphere" "float xyzzy" 2)",
         3, 16, R"(unknown parameter "xyzzy" (known: radius, zmin, zmax, phimax, name))"},
        {R"(WorldBegin
Material "mate")",
         2, 1, R"(unknown material "mate"; did you mean "matte"?)" + known(tables.materials)},
        {R"(WorldBegin
Material "matte" "rgb Kd" [.5 .5 .5] "float sigmaa" 3)",
         2, 38,
         R"(unknown parameter "sigmaa"; did you mean "sigma"? (known: Kd, reflectance, sigma, normalmap, )"
         "displacement, bumpmap)"},
        {R"(WorldBegin
Material "matte" "float Kd" .5)",
         2, 18, R"(parameter "Kd" must be rgb or spectrum or blackbody or texture, not float)"},
        {R"(WorldBegin
Material "measured")",
         2, 1, R"(parameter "filename" is missing)"},
        {R"(WorldBegin
Texture "t" "rgb" "imagemap" "string filename" "none.png")",
         2, 30, R"(file "none.png" not found; looked for "none.png")"},
        {R"(WorldBegin
Texture "t" "rgb" "wood")",
         2, 1, R"(unknown texture "wood")" + known(tables.textures)},
        {R"(WorldBegin
Texture "t" "rgb" "checkerboard" "integer dimension" 5)",
         2, 34, R"("dimension" must be 2 or 3)"},
        {R"(WorldBegin
Texture "t" "rgb" "checkerboard" "string aamode" "box")",
         2, 34, R"(unknown aamode "box" (known: none, closedform, supersample))"},
    });
}

TEST(BuildErrors, Files) {
    const test::TemporaryFolder folder;
    const std::string ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                            "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                            "end_header\n0 0 0\n";
    folder.write("nan.ply", ply + "1 0 nan\n0 1 0\n3 0 1 2\n");
    folder.write("index.ply", ply + "1 0 0\n0 1 0\n3 0 1 7\n");
    folder.write("short.ply", ply + "1 0 0\n0 1 0\n");
    folder.write("text.ply", "hello\n");
    folder.write("words.brdf", "31 xx\n");
    folder.write("short.binary", "zzz");
    const std::string prefix = folder.path().string() + '/';
    const std::vector<MessageCase> cases = {
        {R"(WorldBegin
Shape "plymesh" "string filename" "none.ply")",
         2, 17, R"(file "none.ply" not found; looked for "none.ply")"},
        {R"(WorldBegin
Shape "plymesh" "string filename" "text.ply")",
         2, 17, R"("text.ply": is not a PLY file (it does not start with the line "ply"))"},
        {R"(WorldBegin
Shape "plymesh" "string filename" "nan.ply")",
         2, 17, "the position of vertex 1 is not finite"},
        {R"(WorldBegin
Shape "plymesh" "string filename" "short.ply")",
         2, 17, R"("short.ply": ends in the middle of element "face")"},
        {R"(WorldBegin
Shape "plymesh" "string filename" "index.ply")",
         2, 17, R"("index.ply": face 0 refers to vertex 7, but there are 3 vertices)"},
        {R"(WorldBegin
Texture "t" "rgb" "imagemap" "string filename" "a/none.png")",
         2, 30, R"(file "a/none.png" not found; looked for "a/none.png")"},
        {R"(WorldBegin
Material "measured" "string filename" "text.ply")",
         2, 21,
         R"(unknown extension ".ply" of a measured BRDF (known: .brdf for pbrt-v2's text format, .binary and .merl for MERL))"},
        {R"(WorldBegin
Material "measured" "string filename" "words.brdf")",
         2, 21, "BRDF file words.brdf, line 1: not a number"},
        {R"(WorldBegin
Material "measured" "string filename" "short.binary")",
         2, 21, "MERL file short.binary: the header is incomplete"},
    };
    for (const MessageCase& expected : cases) {
        std::string error = outcomeOf(expected.text, folder.path() / "t.scene").error;
        for (size_t begin = error.find(prefix); begin != std::string::npos; begin = error.find(prefix))
            error.erase(begin, prefix.size());
        EXPECT_EQ(error, formatted(expected)) << expected.text;
    }
    // The end of the message is that of the image library.
    const std::string image = outcomeOf(R"(WorldBegin
Texture "t" "rgb" "imagemap" "string filename" "text.ply")",
                                        folder.path() / "t.scene")
                                  .error;
    EXPECT_EQ(image.find(prefix + "t.scene:2:30: error: cannot read the image " + prefix + "text.ply: "), 0u)
        << image;
}

TEST(BuildErrors, UnreadParametersOfPbrtFilesAreWarnings) {
    const MessageCase misspelt{
        R"(Camera "perspective"
WorldBegin
LightSource "point"
Shape "sphere" "float raduis" 2)",
        4, 16,
        R"(unknown parameter "raduis"; did you mean "radius"? (known: radius, zmin, zmax, phimax, name))"};
    EXPECT_EQ(outcomeOf(misspelt.text).error, formatted(misspelt));
    const Outcome lenient = outcomeOf(misspelt.text, "t.pbrt");
    EXPECT_EQ(lenient.error, "");
    MessageCase warned = misspelt;
    warned.message =
        R"(parameter "raduis" is ignored; did you mean "radius"? (known: radius, zmin, zmax, phimax, name))";
    EXPECT_EQ(lenient.warnings, std::vector<std::string>{formatted(warned, "warning", "t.pbrt")});
    // A wrong type stays an error.
    const MessageCase type{R"(WorldBegin
Shape "sphere" "string radius" "2")",
                           2, 16, R"(parameter "radius" must be float or integer, not string)"};
    EXPECT_EQ(outcomeOf(type.text, "t.pbrt").error, formatted(type, "error", "t.pbrt"));
}

TEST(BuildErrors, CommandLine) {
    const auto withDefine = [](const std::string& define) {
        BuildOptions options;
        options.defines = {define};
        return outcomeOf(R"(WorldBegin
LightSource "point")",
                         "t.scene", options)
            .error;
    };
    EXPECT_EQ(withDefine("maxdepth=2"), "");
    EXPECT_EQ(
        withDefine("maxdepht=2"),
        R"(error: -D maxdepht=2: unknown parameter "maxdepht"; did you mean "maxdepth"? (known: maxdepth, strategy, lightsampler, lightsamples, lightmotion, transparentdepth))");
    EXPECT_EQ(withDefine("maxdepth"), "error: -D maxdepth: write it as name=value");
    EXPECT_EQ(withDefine("maxdepth=x"), R"(error: -D maxdepth=x: "x" is not a number (integer is expected))");
    EXPECT_EQ(withDefine("maxdepth=-1"), R"(error: -D maxdepth: must not be negative)");

    BuildOptions integrator;
    integrator.integrator = "supersampel";
    EXPECT_EQ(outcomeOf("WorldBegin", "t.scene", integrator).error,
              R"(error: unknown integrator "supersampel"; did you mean "supersample"?)" +
                  known(pluginTables().integrators));
    BuildOptions crop;
    crop.crop = {2, 3, 0, 1};
    EXPECT_EQ(outcomeOf("WorldBegin", "t.scene", crop).error, "error: the crop window contains no pixels");
}

TEST(BuildErrors, WarningsOfSceneFiles) {
    EXPECT_EQ(outcomeOf("WorldBegin").warnings,
              std::vector<std::string>{"warning: the scene has no lights; the image will be black"});
    const MessageCase nurbs{R"(WorldBegin
LightSource "point"
Shape "nurbs")",
                            3, 1, R"(shape "nurbs" is not supported; it is skipped)"};
    EXPECT_EQ(outcomeOf(nurbs.text).warnings, std::vector<std::string>{formatted(nurbs, "warning")});
    EXPECT_EQ(outcomeOf(nurbs.text).error, "");
}

} // namespace
} // namespace strobe
