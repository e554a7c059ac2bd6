// The exact text of the messages for wrong scenes, and that no bytes at all crash the parser.
#include "support/scene_text.h"

#include <random>

using namespace strobe;
using namespace strobe::test;

namespace {

struct Wrong {
    const char* text;
    const char* message; ///< without "t.scene:"
};

void expectErrors(const std::vector<Wrong>& cases) {
    for (const Wrong& wrong : cases)
        EXPECT_EQ(parseString(wrong.text).error, std::string("t.scene:") + wrong.message) << wrong.text;
}

TEST(SceneErrors, Directives) {
    expectErrors({
        {"WorldBegin\n  Shpae \"sphere\"", "2:3: error: unknown directive 'Shpae'; did you mean \"Shape\"?\n"
                                           "    Shpae \"sphere\"\n"
                                           "    ^"},
        {"Xyzzy 3", "1:1: error: unknown directive 'Xyzzy'\n  Xyzzy 3\n  ^"},
        {"WorldBegin \"float x\" 3", "1:12: error: expected a directive, found \"float x\"\n"
                                     "  WorldBegin \"float x\" 3\n             ^"},
        {"WorldBegin ] 3", "1:12: error: expected a directive, found ']'\n  WorldBegin ] 3\n             ^"},
        {"WorldBegin Shape sphere", "1:18: error: Shape needs a name in quotes, found 'sphere'\n"
                                    "  WorldBegin Shape sphere\n                   ^"},
        {"WorldBegin\nShape",
         "2:6: error: Shape needs a name in quotes, found the end of the file\n  Shape\n       ^"},
        {"Camera \"perspective\"", "1:21: error: the scene has no WorldBegin\n  Camera \"perspective\"\n"
                                   "                      ^"},
        {"", "1:1: error: the scene has no WorldBegin\n  \n  ^"},
    });
}

TEST(SceneErrors, Blocks) {
    expectErrors({
        {"WorldBegin\nCamera \"perspective\"",
         "2:1: error: Camera must come before WorldBegin (t.scene:1:1)\n"
         "  Camera \"perspective\"\n  ^"},
        {"Shape \"sphere\" WorldBegin", "1:1: error: Shape must come after WorldBegin\n"
                                        "  Shape \"sphere\" WorldBegin\n  ^"},
        {"WorldBegin WorldBegin", "1:12: error: WorldBegin must come before WorldBegin (t.scene:1:1)\n"
                                  "  WorldBegin WorldBegin\n             ^"},
        {"WorldBegin WorldEnd\nIdentity",
         "2:1: error: Identity after WorldEnd (t.scene:1:12): there is one scene to "
         "a run\n  Identity\n  ^"},
        {"WorldBegin\n AttributeBegin",
         "2:2: error: AttributeBegin is never closed\n   AttributeBegin\n   ^"},
        {"WorldBegin\n AttributeBegin WorldEnd", "2:2: error: AttributeBegin is never closed\n"
                                                 "   AttributeBegin WorldEnd\n   ^"},
        {"WorldBegin AttributeEnd", "1:12: error: AttributeEnd without AttributeBegin\n"
                                    "  WorldBegin AttributeEnd\n             ^"},
        {"WorldBegin AttributeBegin\nTransformBegin AttributeEnd",
         "2:16: error: AttributeEnd comes before the end of TransformBegin (t.scene:2:1)\n"
         "  TransformBegin AttributeEnd\n                 ^"},
        {"WorldBegin ObjectBegin \"a\"", "1:12: error: ObjectBegin is never closed\n"
                                         "  WorldBegin ObjectBegin \"a\"\n             ^"},
        {"WorldBegin ObjectEnd",
         "1:12: error: ObjectEnd without ObjectBegin\n  WorldBegin ObjectEnd\n             ^"},
        {"WorldBegin ObjectBegin \"a\"\nObjectBegin \"b\"",
         "2:1: error: ObjectBegin inside object \"a\" (t.scene:1:12)\n  ObjectBegin \"b\"\n  ^"},
    });
}

TEST(SceneErrors, Names) {
    expectErrors({
        {"WorldBegin ObjectInstance \"tree\"",
         "1:27: error: unknown object \"tree\"\n"
         "  WorldBegin ObjectInstance \"tree\"\n                            ^"},
        {"WorldBegin ObjectBegin \"a\" ObjectEnd\nObjectBegin \"b\" ObjectInstance \"b\" ObjectEnd",
         "2:32: error: object \"b\" holds an instance of itself\n  ObjectBegin \"b\" ObjectInstance \"b\" "
         "ObjectEnd\n"
         "                                 ^"},
        {"WorldBegin MakeNamedMaterial \"red\" \"string type\" \"matte\"\nNamedMaterial \"rde\"",
         "2:15: error: unknown material \"rde\"; did you mean \"red\"?\n  NamedMaterial \"rde\"\n            "
         "    ^"},
        {"WorldBegin MakeNamedMaterial \"red\"", "1:12: error: parameter \"type\" is missing\n"
                                                 "  WorldBegin MakeNamedMaterial \"red\"\n             ^"},
        {"WorldBegin Texture \"wood\" \"rgb\" \"imagemap\"\nMaterial \"matte\" \"texture Kd\" \"woo\"",
         "2:18: error: unknown texture \"woo\"; did you mean \"wood\"?\n  Material \"matte\" \"texture Kd\" "
         "\"woo\"\n"
         "                   ^"},
        {"WorldBegin Texture \"wood\" \"vector\" \"imagemap\"",
         "1:27: error: unknown texture type \"vector\" (known: float, rgb, color, spectrum)\n"
         "  WorldBegin Texture \"wood\" \"vector\" \"imagemap\"\n                            ^"},
        {"Camera \"p\" CoordSysTransform \"Camera\"",
         "1:30: error: unknown coordinate system \"Camera\"; did you mean \"camera\"?\n"
         "  Camera \"p\" CoordSysTransform \"Camera\"\n                               ^"},
        {"Attribute \"shap\" \"float x\" 1",
         "1:11: error: unknown target \"shap\"; did you mean \"shape\"? (known: shape, "
         "light, material, medium, texture)\n"
         "  Attribute \"shap\" \"float x\" 1\n            ^"},
        {"Option \"string conventions\" \"v2\"",
         "1:8: error: unknown conventions \"v2\" (known: pbrt-v2, pbrt-v4)\n"
         "  Option \"string conventions\" \"v2\"\n         ^"},
    });
}

TEST(SceneErrors, Parameters) {
    expectErrors({
        {"Film \"f\" \"flaot x\" 1",
         "1:10: error: unknown parameter type \"flaot\"; did you mean \"float\"? (known: "
         "integer, float, bool, string, point2, vector2, point, point3, vector, vector3, "
         "normal, normal3, color, rgb, spectrum, blackbody, texture)\n"
         "  Film \"f\" \"flaot x\" 1\n           ^"},
        {"Film \"f\" \"x\" 1", "1:10: error: expected \"type name\" and a value, found \"x\"\n"
                               "  Film \"f\" \"x\" 1\n           ^"},
        {"Film \"f\" \"float x y\" 1",
         "1:10: error: expected \"type name\" and a value, found \"float x y\"\n"
         "  Film \"f\" \"float x y\" 1\n           ^"},
        {"Film \"f\" \"float x\" 1 \"float x\" 2",
         "1:22: error: parameter \"x\" is given twice\n"
         "  Film \"f\" \"float x\" 1 \"float x\" 2\n                       ^"},
        {"Film \"f\" \"float x\"",
         "1:10: error: parameter \"x\" has no value\n  Film \"f\" \"float x\"\n           ^"},
        {"Film \"f\" \"float x\"\nWorldBegin", "1:10: error: parameter \"x\" has no value\n"
                                               "  Film \"f\" \"float x\"\n           ^"},
        {"Film \"f\" \"float x\" \"wide\"", "1:20: error: parameter \"x\" needs a number, found \"wide\"\n"
                                            "  Film \"f\" \"float x\" \"wide\"\n                     ^"},
        {"Film \"f\" \"float x\" [1 NaN]", "1:23: error: parameter \"x\" needs a number or ']', found 'NaN'\n"
                                           "  Film \"f\" \"float x\" [1 NaN]\n                        ^"},
        {"Film \"f\" \"float x\" -inf", "1:20: error: '-inf' is not a number\n  Film \"f\" \"float x\" -inf\n"
                                        "                     ^"},
        {"Film \"f\" \"float x\" 1e40", "1:20: error: '1e40' is too large for a 32-bit float\n"
                                        "  Film \"f\" \"float x\" 1e40\n                     ^"},
        {"Film \"f\" \"integer x\" 3000000000",
         "1:22: error: '3000000000' does not fit a 32-bit integer\n"
         "  Film \"f\" \"integer x\" 3000000000\n                       ^"},
        {"Film \"f\" \"integer x\" [1 2.5]",
         "1:25: error: '2.5' is not an integer\n"
         "  Film \"f\" \"integer x\" [1 2.5]\n                          ^"},
        {"Film \"f\" \"bool x\" 1", "1:19: error: parameter \"x\" needs true or false, found '1'\n"
                                    "  Film \"f\" \"bool x\" 1\n                    ^"},
        {"Film \"f\" \"bool x\" \"yes\"", "1:19: error: parameter \"x\" needs true or false, found \"yes\"\n"
                                          "  Film \"f\" \"bool x\" \"yes\"\n                    ^"},
        {"Film \"f\" \"string x\" 3", "1:21: error: parameter \"x\" needs a string, found '3'\n"
                                      "  Film \"f\" \"string x\" 3\n                      ^"},
        {"Film \"f\" \"point2 x\" [1 2 3]", "1:10: error: parameter \"x\" needs numbers in pairs, got 3\n"
                                            "  Film \"f\" \"point2 x\" [1 2 3]\n           ^"},
        {"Film \"f\" \"point x\" [1 2]", "1:10: error: parameter \"x\" needs numbers in threes, got 2\n"
                                         "  Film \"f\" \"point x\" [1 2]\n           ^"},
        {"Film \"f\" \"rgb x\" 1",
         "1:10: error: parameter \"x\" needs numbers in threes, got 1; write them in brackets\n"
         "  Film \"f\" \"rgb x\" 1\n           ^"},
        {"Film \"f\" \"spectrum x\" [400 1 500]",
         "1:10: error: parameter \"x\" needs numbers in pairs of a wavelength and a value, got 3\n"
         "  Film \"f\" \"spectrum x\" [400 1 500]\n           ^"},
        {"Film \"f\" \"float x\" [1 2",
         "1:20: error: '[' without a closing ']'\n  Film \"f\" \"float x\" [1 2\n"
         "                     ^"},
        {"Film \"f\" \"float x\" [1 2\n\"float y\" 3",
         "2:1: error: parameter \"x\" needs a number or ']', found "
         "\"float y\"\n  \"float y\" 3\n  ^"},
        {"WorldBegin Material \"m\" \"texture Kd\" [\"a\" \"b\"]",
         "1:25: error: parameter \"Kd\" needs the name of one texture, got 2\n"
         "  WorldBegin Material \"m\" \"texture Kd\" [\"a\" \"b\"]\n                          ^"},
    });
}

TEST(SceneErrors, Text) {
    expectErrors({
        {"Film \"image\n",
         "1:6: error: string without a closing quote on its line\n  Film \"image\n       ^"},
        {"Film \"ima\\qge\"", "1:10: error: unknown escape '\\q'; write a backslash as '\\\\'\n"
                              "  Film \"ima\\qge\"\n           ^"},
        {"\x7f\x45LF\x02", "1:1: error: unexpected byte 0x7f; is this a text file?\n  ?ELF?\n  ^"},
        {"WorldBegin {", "1:12: error: unexpected character '{'\n  WorldBegin {\n             ^"},
    });
}

TEST(SceneErrors, Transforms) {
    expectErrors({
        {"TransformTimes 0 1 1", "1:20: error: TransformTimes must ascend\n  TransformTimes 0 1 1\n"
                                 "                     ^"},
        {"TransformTimes 0",
         "1:1: error: TransformTimes needs at least two numbers, got 1\n  TransformTimes 0\n  ^"},
        {"WorldBegin TransformTimes 0 1",
         "1:12: error: TransformTimes must come before WorldBegin (t.scene:1:1)\n"
         "  WorldBegin TransformTimes 0 1\n             ^"},
        {"ActiveTransform EndTime Translate 1 0 0\nTransformTimes 0 1 2",
         "2:1: error: TransformTimes must come before transforms that move\n  TransformTimes 0 1 2\n  ^"},
        {"ActiveTransform 2",
         "1:17: error: there is no key 2: TransformTimes has keys 0 to 1\n  ActiveTransform 2\n"
         "                  ^"},
        {"ActiveTransform Begin",
         "1:17: error: ActiveTransform needs StartTime, EndTime, All or the number of a key, "
         "found 'Begin'\n  ActiveTransform Begin\n                  ^"},
        {"LookAt 1 2 3 1 2 3 0 1 0", "1:1: error: LookAt: the eye and the point looked at are the same\n"
                                     "  LookAt 1 2 3 1 2 3 0 1 0\n  ^"},
        {"LookAt 0 0 0 0 1 0 0 2 0",
         "1:1: error: LookAt: the up vector is parallel to the direction of view\n"
         "  LookAt 0 0 0 0 1 0 0 2 0\n  ^"},
        {"LookAt 0 0 0 0 1 0", "1:19: error: LookAt needs a number, found the end of the file\n"
                               "  LookAt 0 0 0 0 1 0\n                    ^"},
        {"Scale 1 0 1",
         "1:1: error: Scale by zero or by too large or small a number flattens space\n  Scale 1 0 1\n"
         "  ^"},
        {"Rotate 90 0 0 0", "1:1: error: Rotate needs an axis that is not zero\n  Rotate 90 0 0 0\n  ^"},
        {"Transform [1 2 3 0 2 4 6 0 0 0 1 0 0 0 0 1]",
         "1:1: error: the matrix is singular: it has no inverse\n  Transform [1 2 3 0 2 4 6 0 0 0 1 0 0 0 0 "
         "1]\n  ^"},
        {"ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1]",
         "1:1: error: the last column of the matrix (every fourth number) must be 0 0 0 1\n"
         "  ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1]\n  ^"},
        {"Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 5]",
         "1:44: error: Transform needs 16 numbers and ']', found '5'\n"
         "  Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 5]\n"
         "                                             ^"},
        {"Scale 1e-9 1e-9 1e-9 Scale 1e-9 1e-9 1e-9",
         "1:22: error: the current transform becomes too large or too small to be inverted\n"
         "  Scale 1e-9 1e-9 1e-9 Scale 1e-9 1e-9 1e-9\n                       ^"},
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
    folder.write("loop.pbrt", "Include \"main.scene\"");
    folder.write("wrong.pbrt", "Shape \"a\"\n  Shape 1");
    EXPECT_EQ(error("Include \"no.pbrt\""),
              dir + "main.scene:1:9: error: file \"no.pbrt\" not found; looked for \"" + dir +
                  "no.pbrt\"\n  Include \"no.pbrt\"\n          ^");
    EXPECT_EQ(error("Include \"loop.pbrt\""),
              dir + "loop.pbrt:1:9: error: " + "\"" +
                  (dir + "main.scene\" includes itself\n  Include \"main.scene\"\n") + "          ^");
    EXPECT_EQ(error("Include \"main.scene\"").find(dir + "main.scene:1:9: error: "), 0u);
    EXPECT_EQ(error("Include 3"),
              dir + "main.scene:1:9: error: Include needs the name of a file in quotes, found '3'\n"
                    "  Include 3\n          ^");
    EXPECT_EQ(error("WorldBegin Include \"wrong.pbrt\""),
              dir +
                  "wrong.pbrt:2:9: error: Shape needs a name in quotes, found '1'\n    Shape 1\n          ^");
    for (int i = 0; i < 70; ++i)
        folder.write("deep" + std::to_string(i), "Include \"deep" + std::to_string(i + 1) + "\"");
    EXPECT_NE(error("Include \"deep0\"").find("files include one another more than 64 deep"),
              std::string::npos);
}

/// A scene with every directive, to be spoilt.
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

TEST(SceneErrors, SampleIsRight) {
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
    int right = 0, wrong = 0;
    for (int i = 0; i < 6000; ++i) {
        std::string text = sample;
        for (size_t k = below(4) + 1; k-- > 0 && !text.empty();) {
            const size_t at = below(text.size()), length = std::min(below(12), text.size() - at);
            switch (below(6)) {
            case 0:
                text[at] = alphabet[below(alphabet.size())];
                break;
            case 1:
                text.erase(at, length);
                break;
            case 2:
                text.insert(at, sample.substr(below(sample.size()), 30));
                break;
            case 3:
                text.resize(at + 1);
                break;
            case 4:
                text.insert(at, 1, alphabet[below(alphabet.size())]);
                break;
            default:
                text[at] = static_cast<char>(random());
            }
        }
        const Parsed parsed = parseString(text, i % 2 ? "t.pbrt" : "t.scene");
        ++(parsed.error.empty() ? right : wrong);
    }
    EXPECT_GT(right, 50); // else the mutations are too coarse to reach the inner parts
    EXPECT_GT(wrong, 1000);
}

} // namespace
