// The messages of scenes with mistakes; random mutations of a scene must not crash the parser.
#include "support/scene_text.h"

#include <random>

using namespace strobe;
using namespace strobe::test;

namespace {

void expectErrors(const std::vector<MessageCase>& cases) {
    for (const MessageCase& expected : cases)
        EXPECT_EQ(parseString(expected.text).error, formatted(expected)) << expected.text;
}

TEST(SceneErrors, Directives) {
    expectErrors({
        {R"(WorldBegin
  Shpae "sphere")",
         2, 3, R"(unknown directive 'Shpae'; did you mean "Shape"?)"},
        {"Xyzzy 3", 1, 1, "unknown directive 'Xyzzy'"},
        {R"(WorldBegin "float x" 3)", 1, 12, R"(expected a directive, found "float x")"},
        {"WorldBegin ] 3", 1, 12, "expected a directive, found ']'"},
        {"WorldBegin Shape sphere", 1, 18, "Shape needs a name in quotes, found 'sphere'"},
        {R"(WorldBegin
Shape)",
         2, 6, "Shape needs a name in quotes, found the end of the file"},
        {R"(Camera "perspective")", 1, 21, "the scene has no WorldBegin"},
        {"", 1, 1, "the scene has no WorldBegin"},
    });
}

TEST(SceneErrors, Blocks) {
    expectErrors({
        {R"(WorldBegin
Camera "perspective")",
         2, 1, "Camera must come before WorldBegin (t.scene:1:1)"},
        {R"(Shape "sphere" WorldBegin)", 1, 1, "Shape must come after WorldBegin"},
        {"WorldBegin WorldBegin", 1, 12, "a second WorldBegin; the first is at t.scene:1:1"},
        {R"(WorldBegin WorldEnd
Identity)",
         2, 1, "Identity after WorldEnd (t.scene:1:12); a run renders one scene"},
        {R"(WorldBegin
 AttributeBegin)",
         2, 2, "AttributeBegin is never closed"},
        {R"(WorldBegin
 AttributeBegin WorldEnd)",
         2, 2, "AttributeBegin is never closed"},
        {"WorldBegin AttributeEnd", 1, 12, "AttributeEnd without AttributeBegin"},
        {R"(WorldBegin AttributeBegin
TransformBegin AttributeEnd)",
         2, 16, "AttributeEnd does not match TransformBegin (t.scene:2:1)"},
        {R"(WorldBegin ObjectBegin "a")", 1, 12, "ObjectBegin is never closed"},
        {"WorldBegin ObjectEnd", 1, 12, "ObjectEnd without ObjectBegin"},
        {R"(WorldBegin ObjectBegin "a"
ObjectBegin "b")",
         2, 1, R"(ObjectBegin inside object "a" (t.scene:1:12))"},
    });
}

TEST(SceneErrors, Names) {
    expectErrors({
        {R"(WorldBegin ObjectInstance "tree")", 1, 27, R"(unknown object "tree")"},
        {R"(WorldBegin ObjectBegin "a" ObjectEnd
ObjectBegin "b" ObjectInstance "b" ObjectEnd)",
         2, 32, R"(object "b" contains an instance of itself)"},
        {R"(WorldBegin MakeNamedMaterial "red" "string type" "matte"
NamedMaterial "rde")",
         2, 15, R"(unknown material "rde"; did you mean "red"?)"},
        {R"(WorldBegin MakeNamedMaterial "red")", 1, 12, R"(parameter "type" is missing)"},
        {R"(WorldBegin Texture "wood" "rgb" "imagemap"
Material "matte" "texture Kd" "woo")",
         2, 18, R"(unknown texture "woo"; did you mean "wood"?)"},
        {R"(WorldBegin Texture "wood" "vector" "imagemap")", 1, 27,
         R"(unknown texture type "vector" (known: float, rgb, color, spectrum))"},
        {R"(Camera "p" CoordSysTransform "Camera")", 1, 30,
         R"(unknown coordinate system "Camera"; did you mean "camera"?)"},
        {R"(Attribute "shap" "float x" 1)", 1, 11,
         R"(unknown Attribute target "shap"; did you mean "shape"? (known: shape, light, material, medium, texture))"},
        {R"(Option "string conventions" "v2")", 1, 8,
         R"(unknown conventions "v2" (known: pbrt-v2, pbrt-v4))"},
    });
}

TEST(SceneErrors, Parameters) {
    expectErrors({
        {R"(Film "f" "flaot x" 1)", 1, 10,
         R"(unknown parameter type "flaot"; did you mean "float"? (known: integer, float, bool, string, point2, vector2, point, point3, vector, vector3, normal, normal3, color, rgb, spectrum, blackbody, texture))"},
        {R"(Film "f" "x" 1)", 1, 10, R"(expected "type name" and a value, found "x")"},
        {R"(Film "f" "float x y" 1)", 1, 10, R"(expected "type name" and a value, found "float x y")"},
        {R"(Film "f" "float x" 1 "float x" 2)", 1, 22, R"(parameter "x" is given twice)"},
        {R"(Film "f" "float x")", 1, 10, R"(parameter "x" has no value)"},
        {R"(Film "f" "float x"
WorldBegin)",
         1, 10, R"(parameter "x" has no value)"},
        {R"(Film "f" "float x" "wide")", 1, 20, R"(parameter "x" needs a number, found "wide")"},
        {R"(Film "f" "float x" [1 NaN])", 1, 23, R"(parameter "x" needs a number or ']', found 'NaN')"},
        {R"(Film "f" "float x" -inf)", 1, 20, "'-inf' is not a number"},
        {R"(Film "f" "float x" 1e40)", 1, 20, "'1e40' is too large for a 32-bit float"},
        {R"(Film "f" "integer x" 3000000000)", 1, 22, "'3000000000' does not fit a 32-bit integer"},
        {R"(Film "f" "integer x" [1 2.5])", 1, 25, "'2.5' is not an integer"},
        {R"(Film "f" "bool x" 1)", 1, 19, R"(parameter "x" needs true or false, found '1')"},
        {R"(Film "f" "bool x" "yes")", 1, 19, R"(parameter "x" needs true or false, found "yes")"},
        {R"(Film "f" "string x" 3)", 1, 21, R"(parameter "x" needs a string, found '3')"},
        {R"(Film "f" "point2 x" [1 2 3])", 1, 10, R"(parameter "x" needs pairs of numbers, got 3 numbers)"},
        {R"(Film "f" "point x" [1 2])", 1, 10, R"(parameter "x" needs triples of numbers, got 2 numbers)"},
        {R"(Film "f" "rgb x" 1)", 1, 10,
         R"(parameter "x" needs triples of numbers, got 1 number; write them in brackets)"},
        {R"(Film "f" "spectrum x" [400 1 500])", 1, 10,
         R"(parameter "x" needs pairs of a wavelength and a value, got 3 numbers)"},
        {R"(Film "f" "float x" [1 2)", 1, 20, "'[' without a closing ']'"},
        {R"(Film "f" "float x" [1 2
"float y" 3)",
         2, 1, R"(parameter "x" needs a number or ']', found "float y")"},
        {R"(WorldBegin Material "m" "texture Kd" ["a" "b"])", 1, 25,
         R"(parameter "Kd" needs the name of one texture, got 2)"},
    });
}

TEST(SceneErrors, Text) {
    expectErrors({
        {R"(Film "image
)",
         1, 6, "string without a closing quote on the same line"},
        {R"(Film "ima\qge")", 1, 10, R"(unknown escape '\q'; write a backslash as '\\')"},
        {"\x7f\x45LF\x02", 1, 1, "unexpected byte 0x7f; is this a text file?"},
        {"WorldBegin {", 1, 12, "unexpected character '{'"},
    });
}

TEST(SceneErrors, Transforms) {
    expectErrors({
        {"TransformTimes 0 1 1", 1, 20, "the numbers of TransformTimes must ascend"},
        {"TransformTimes 0", 1, 1, "TransformTimes needs at least two numbers, got 1"},
        {"WorldBegin TransformTimes 0 1", 1, 12, "TransformTimes must come before WorldBegin (t.scene:1:1)"},
        {R"(ActiveTransform EndTime Translate 1 0 0
TransformTimes 0 1 2)",
         2, 1, "TransformTimes must come before animated transforms"},
        {"ActiveTransform 2", 1, 17, "there is no key 2; the keys of TransformTimes are 0 to 1"},
        {"ActiveTransform Begin", 1, 17,
         "ActiveTransform needs StartTime, EndTime, All or the index of a key, found 'Begin'"},
        {"LookAt 1 2 3 1 2 3 0 1 0", 1, 1, "LookAt: the eye and the look-at point are the same"},
        {"LookAt 0 0 0 0 1 0 0 2 0", 1, 1, "LookAt: the up vector is parallel to the viewing direction"},
        {"LookAt 0 0 0 0 1 0", 1, 19, "LookAt needs a number, found the end of the file"},
        {"Scale 1 0 1", 1, 1, "Scale factors must not be zero, or too large or too small to invert"},
        {"Rotate 90 0 0 0", 1, 1, "Rotate: the axis is zero"},
        {"Transform [1 2 3 0 2 4 6 0 0 0 1 0 0 0 0 1]", 1, 1, "the matrix is singular: it has no inverse"},
        {"ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1]", 1, 1,
         "the last column of the matrix (every fourth number) must be 0 0 0 1"},
        {"Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 5]", 1, 44,
         "Transform needs 16 numbers and ']', found '5'"},
        {"Scale 1e-9 1e-9 1e-9 Scale 1e-9 1e-9 1e-9", 1, 22,
         "the current transform becomes too large or too small to invert"},
    });
}

TEST(SceneErrors, Includes) {
    const TemporaryFolder folder;
    const std::string dir = folder.path().string() + "/";
    const auto error = [&](const std::string& text) {
        folder.write("main.scene", text);
        Diagnostics quiet;
        try {
            parseFiles({dir + "main.scene"}, {}, quiet);
        } catch (const Error& e) {
            return formatDiagnostic(e.location, "error", e.what());
        }
        return std::string();
    };
    const MessageCase missing{R"(Include "no.pbrt")", 1, 9,
                              R"(file "no.pbrt" not found; looked for ")" + dir + R"(no.pbrt")"};
    EXPECT_EQ(error(missing.text), formatted(missing, "error", dir + "main.scene"));

    folder.write("loop.pbrt", R"(Include "main.scene")");
    const MessageCase loop{R"(Include "main.scene")", 1, 9, '"' + dir + R"(main.scene" includes itself)"};
    EXPECT_EQ(error(R"(Include "loop.pbrt")"), formatted(loop, "error", dir + "loop.pbrt"));
    EXPECT_EQ(error(loop.text), formatted(loop, "error", dir + "main.scene"));

    const MessageCase number{"Include 3", 1, 9, "Include needs the name of a file in quotes, found '3'"};
    EXPECT_EQ(error(number.text), formatted(number, "error", dir + "main.scene"));

    const MessageCase included{R"(Shape "a"
  Shape 1)",
                               2, 9, "Shape needs a name in quotes, found '1'"};
    folder.write("wrong.pbrt", included.text);
    EXPECT_EQ(error(R"(WorldBegin Include "wrong.pbrt")"), formatted(included, "error", dir + "wrong.pbrt"));

    for (int i = 0; i < 70; ++i)
        folder.write("deep" + std::to_string(i), R"(Include "deep)" + std::to_string(i + 1) + '"');
    EXPECT_NE(error(R"(Include "deep0")").find("Include is nested more than 64 deep"), std::string::npos);
}

/// A scene with every directive.
const char* const kSample = R"(# sample
LookAt 0 1 -5  0 0 0  0 1 0
TransformTimes [0 .5 1]
Camera "perspective" "float fov" [39] "bool flag" true
Film "image" "integer xresolution" [300] "string filename" "a\"b.exr"
Sampler "lowdiscrepancy" "integer pixelsamples" 4
PixelFilter "box"  Accelerator "bvh"  SurfaceIntegrator "path"  Integrator "msaa"
Option "string conventions" "pbrt-v2"  ColorSpace "srgb"
WorldBegin
LightSource "infinite" "blackbody L" [2700 1]  Volume "x"
MakeNamedMaterial "m" "string type" "plastic" "rgb Kd" [1 .5 .25]
Texture "t" "float" "constant" "float value" [.5]
AttributeBegin
  Rotate 30 0 1 0  Scale 2 2 2  ActiveTransform 1  Translate -1e-3 4 5  ActiveTransform All
  Material "matte" "texture sigma" "t"  NamedMaterial "m"  Attribute "shape" "float alpha" 1
  AreaLightSource "area" "spectrum L" [400 1 700 2]  ReverseOrientation
  Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2] "point2 uv" [0 0 1 0 0 1]
AttributeEnd
ObjectBegin "o" TransformBegin ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1] Shape "sphere" TransformEnd ObjectEnd
CoordinateSystem "c" CoordSysTransform "c" Identity ObjectInstance "o"
WorldEnd
)";

TEST(SceneErrors, SampleHasNoError) {
    const Parsed parsed = parseString(kSample);
    EXPECT_EQ(parsed.error, "");
    EXPECT_EQ(parsed.scene.world.shapes.size(), 1u);
    EXPECT_EQ(parsed.scene.objects.size(), 1u);
}

TEST(SceneErrors, NoMutationCrashes) {
    const std::string sample = kSample;
    const std::string alphabet = "\"[]#-+.e0123456789 \n\\\x01\x80\xff";
    std::mt19937 random(7);
    const auto below = [&](size_t n) { return static_cast<size_t>(random() % n); };
    int validCount = 0;
    int invalidCount = 0;
    for (int i = 0; i < 6000; ++i) {
        std::string text = sample;
        for (size_t k = below(4) + 1; k-- > 0 && !text.empty();) {
            const size_t position = below(text.size());
            const size_t length = std::min(below(12), text.size() - position);
            switch (below(6)) {
            case 0:
                text[position] = alphabet[below(alphabet.size())];
                break;
            case 1:
                text.erase(position, length);
                break;
            case 2:
                text.insert(position, sample.substr(below(sample.size()), 30));
                break;
            case 3:
                text.resize(position + 1);
                break;
            case 4:
                text.insert(position, 1, alphabet[below(alphabet.size())]);
                break;
            default:
                text[position] = static_cast<char>(random());
            }
        }
        const Parsed parsed = parseString(text, i % 2 ? "t.pbrt" : "t.scene");
        ++(parsed.error.empty() ? validCount : invalidCount);
    }
    EXPECT_GT(validCount, 50); // mutations must be small enough to pass the lexer
    EXPECT_GT(invalidCount, 1000);
}

} // namespace
