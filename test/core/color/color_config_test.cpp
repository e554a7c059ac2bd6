#include "core/color/color_config.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace strobe {
namespace {

/// Writes configs to a file, which is removed after the test.
class ColorConfigFile : public testing::Test {
  protected:
    void TearDown() override { std::filesystem::remove(m_path); }
    ColorConfig& load(const std::string& text) {
        std::ofstream(m_path) << text;
        m_config = std::make_unique<ColorConfig>(m_path.string());
        return *m_config;
    }
    /// Returns the beginning of error messages.
    std::string title() const { return "the OpenColorIO config \"" + m_path.string() + "\": "; }
    std::filesystem::path m_path =
        std::filesystem::temp_directory_path() / ("strobe-" + std::to_string(::getpid()) + ".ocio");
    std::unique_ptr<ColorConfig> m_config;
};

Rgb transformed(const ColorTransform& transform, Rgb color) {
    if (transform)
        transform({&color, 1});
    return color;
}

template <class F>
std::string errorOf(const F& f, ErrorKind kind = ErrorKind::Usage) {
    try {
        f();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind, kind);
        return e.what();
    }
    return "no error";
}

/// A small config, which tests modify.
const std::string kConfig = R"(ocio_profile_version: 2
strictparsing: true
roles:
  default: work
  scene_linear: work
  aces_interchange: aces
file_rules:
  - !<Rule> {name: plates, pattern: "*plate*", extension: "*", colorspace: work}
  - !<Rule> {name: Default, colorspace: default}
displays:
  screen:
    - !<View> {name: half, colorspace: halved}
    - !<View> {name: graded, colorspace: halved, looks: dark}
  other:
    - !<View> {name: plain, colorspace: work}
looks:
  - !<Look>
    name: dark
    process_space: work
    transform: !<MatrixTransform> {offset: [-0.125, -0.125, -0.125, 0]}
  - !<Look>
    name: bright
    process_space: work
    transform: !<MatrixTransform> {offset: [0.25, 0.25, 0.25, 0]}
colorspaces:
  - !<ColorSpace> {name: work, isdata: false}
  - !<ColorSpace>
    name: halved
    from_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: aces
    from_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
)";

/// Returns `text` with the first occurrence of `before` replaced by `after`.
std::string replaced(std::string text, const std::string& before, const std::string& after) {
    return text.replace(text.find(before), before.size(), after);
}

TEST(BuiltinConfig, StandardViewIsSrgb) {
    const ColorTransform view = ColorConfig().view({});
    for (const Rgb& c : {Rgb(0), Rgb(.002f, .18f, .9f), Rgb(1)})
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(transformed(view, c)[k], encodeSrgb(c[k]),
                        2e-5f); // the sRGB standard rounds the junction of its two formulas
}

TEST(BuiltinConfig, AcesViewIsAToneCurve) {
    const ColorTransform view = ColorConfig().view({"sRGB", "ACES", ""});
    // ACES 1.0 maps 18 % gray to 4.8 cd/m², if white has 48 cd/m².
    EXPECT_NEAR(decodeSrgb(transformed(view, Rgb(.18f)).y), .1f, .005f);
    float last = 0;
    for (const float gray : {.01f, .1f, 1.f, 4.f, 16.f}) {
        const Rgb c = transformed(view, Rgb(gray));
        EXPECT_GT(c.y, last);
        EXPECT_LE(c.y, 1);
        EXPECT_NEAR(c.x, c.z, 2e-3f) << "gray is not neutral";
        last = c.y;
    }
    const Rgb fire = transformed(view, Rgb(60, 4, .1f));
    EXPECT_GT(fire.z, .3f) << "highlights become white";
}

TEST(BuiltinConfig, RawViewIsTheIdentity) {
    EXPECT_EQ(transformed(ColorConfig().view({"", "Raw", ""}), Rgb(.1f, -2, 70)), Rgb(.1f, -2, 70));
}

TEST(BuiltinConfig, ConvertsColorSpacesToTheWorkingSpace) {
    const ColorConfig config;
    EXPECT_FALSE(config.toWorking("lin_rec709", {}));
    EXPECT_FALSE(config.toWorking("data", {}));
    EXPECT_NEAR(transformed(config.toWorking("srgb_texture", {}), Rgb(.5f)).x, decodeSrgb(.5f), 1e-5f);
    for (const char* name : {"ACEScg", "ACES2065-1", "ACEScct"}) {
        const Rgb c = transformed(config.toWorking(name, {}), Rgb(.5f));
        EXPECT_NEAR(c.x, c.y, 1e-4f) << name; // gray stays neutral
        EXPECT_NEAR(c.y, c.z, 1e-4f) << name;
    }
    EXPECT_EQ(config.spaceOfFile("a_acescg.exr", {}), "");
}

TEST(BuiltinConfig, TransformOfManyColorsEqualsTransformOfEach) {
    const ColorTransform view = ColorConfig().view({"", "ACES", ""});
    std::vector<Rgb> many;
    for (int i = 0; i < 20000; ++i)
        many.push_back(Rgb(float(i) * 1e-4f, .3f, 2 - float(i) * 1e-4f));
    std::vector<Rgb> all = many;
    view(all);
    for (size_t i = 0; i < many.size(); i += 997)
        EXPECT_EQ(all[i], transformed(view, many[i]));
}

TEST(BuiltinConfig, ErrorsForUnknownNamesListTheKnownNames) {
    const ColorConfig config;
    const std::string title = "the built-in OpenColorIO config: ";
    EXPECT_EQ(errorOf([&] {
                  config.view({"sGRB", "", ""});
              }),
              title +
                  "unknown display \"sGRB\"; did you mean \"sRGB\"? (known: sRGB, Rec.1886 Rec.709, P3-D65)");
    EXPECT_EQ(errorOf([&] {
                  config.view({"", "Filmic", ""});
              }),
              "the display \"sRGB\" of the built-in OpenColorIO config: unknown view \"Filmic\" (known: "
              "Standard, ACES, "
              "Raw)");
    EXPECT_EQ(errorOf([&] {
                  config.view({"", "", "Punchy"});
              }),
              title + "unknown look \"Punchy\" (there is none)");
    EXPECT_NE(errorOf([&] {
                  config.toWorking("ACES", {});
              }).find("unknown color space \"ACES\" (known: ACES2065-1"),
              std::string::npos);
    const Location location{std::make_shared<Source>(), 0};
    EXPECT_NE(errorOf([&] { config.toWorking("ACES", location); }, ErrorKind::Scene), "no error");
}

TEST_F(ColorConfigFile, LooksReplaceTheLooksOfTheView) {
    // A config that has the working space under a known name is not modified.
    const ColorConfig& config = load(replaced(kConfig, "{name: work,", "{name: work, aliases: [lin_srgb],"));
    EXPECT_EQ(config.workingSpace(), "lin_srgb");
    EXPECT_EQ(transformed(config.view({}), Rgb(1, .5f, 0)), Rgb(.5f, .25f, 0));
    EXPECT_EQ(transformed(config.view({"other", "", ""}), Rgb(1, .5f, 0)), Rgb(1, .5f, 0));
    EXPECT_EQ(transformed(config.view({"", "graded", ""}), Rgb(1)), Rgb(.4375f));
    EXPECT_EQ(transformed(config.view({"", "graded", "bright"}), Rgb(1)), Rgb(.625f))
        << "the look replaces the look of the view";
    EXPECT_EQ(transformed(config.view({"", "", "bright, -dark"}), Rgb(1)), Rgb(.6875f));
    EXPECT_EQ(errorOf([&] {
                  config.view({"", "", "bright, light"});
              }),
              title() + "unknown look \"light\" (known: dark, bright)");
    EXPECT_EQ(errorOf([&] { config.view({"", "", "bright,"}); }), "no error");
    EXPECT_EQ(errorOf([&] {
                  config.view({"", "", ","});
              }),
              title() + "unknown look \"\" (known: dark, bright)");
}

TEST_F(ColorConfigFile, WorkingSpaceIsDerivedFromTheRoleAcesInterchange) {
    const ColorConfig& config = load(kConfig); // in which "work" is ACEScg
    EXPECT_EQ(config.workingSpace(), "lin_rec709");
    const Rgb red = transformed(config.toWorking("work", {}), Rgb(1, 0, 0));
    EXPECT_NEAR(red.x, 1.705051f, 1e-5f);
    EXPECT_NEAR(red.y, -.130256f, 1e-5f);
    EXPECT_NEAR(red.z, -.024003f, 1e-5f);
    const Rgb shown = transformed(config.view({"other", "plain", ""}), red);
    EXPECT_LT((shown - Rgb(1, 0, 0)).length(), 1e-5f);
}

TEST_F(ColorConfigFile, SceneLinearIsTheWorkingSpaceWithoutAcesInterchange) {
    const ColorConfig& config = load(replaced(kConfig, "  aces_interchange: aces\n", ""));
    EXPECT_EQ(config.workingSpace(), "work");
    EXPECT_FALSE(config.toWorking("work", {}));
    EXPECT_EQ(transformed(config.toWorking("halved", {}), Rgb(.5f)), Rgb(1));
    const std::string bare =
        replaced(replaced(kConfig, "  aces_interchange: aces\n", ""), "  scene_linear: work\n", "");
    EXPECT_NE(errorOf([&] { load(bare).view({}); }).find("neither a linear Rec. 709 space"),
              std::string::npos);
}

TEST_F(ColorConfigFile, FileRulesDetermineColorSpaces) {
    const ColorConfig& config = load(kConfig);
    EXPECT_EQ(config.spaceOfFile("/shots/plate_7.exr", {}), "work");
    EXPECT_EQ(config.spaceOfFile("/shots/wood.exr", {}), "");
}

TEST_F(ColorConfigFile, UnreadableConfigsAreErrorsOnFirstUse) {
    const ColorConfig missing("none.ocio");
    EXPECT_EQ(errorOf([&] { missing.view({}); }),
              "the OpenColorIO config \"none.ocio\": Error could not read 'none.ocio' OCIO profile.");
    EXPECT_NE(errorOf([&] { missing.view({}); }), "no error") << "on second use";
    EXPECT_NE(errorOf([&] { load("unknown: key\n").view({}); }), "no error");
    EXPECT_NE(errorOf([&] {
                  load(replaced(kConfig, "looks: dark", "looks: none")).view({"", "graded", ""});
              }),
              "no error");
}

} // namespace
} // namespace strobe
