#include "session/frame.h"
#include "session_fixture.h"

namespace strobe::test {
namespace {

/// Returns the error of options that `change` has changed; empty if there is none.
template <class Change>
std::string optionsError(const Change& change) {
    RenderOptions options;
    change(options);
    return usageError([&] { checkOptions(options); });
}

TEST(OptionsTest, DefaultsAreValid) {
    EXPECT_EQ(optionsError([](RenderOptions&) {}), "");
}

TEST(OptionsTest, OptionsThatExcludeEachOtherAreErrors) {
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.progressive.noiseTarget = 1;
                  o.output.aovs = {Aov::Depth, Aov::Shades};
              }),
              "--aov shades: does not go with --noise-target");
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.progressive.checkpointInterval = 1;
                  o.sequence.emplace().frames = {1, 2};
              }),
              "--frames with several frames: does not go with --checkpoint");
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.build.crop = {0, 1, 0, 1};
                  o.build.pixelBounds = PixelBounds{0, 0, 1, 1};
              }),
              "--pixel-bounds: does not go with --crop");
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.build.shutter = Shutter{1, 1};
                  o.sequence.emplace();
              }),
              "--frame-time: renders a single frame; it does not go with --frames");
}

TEST(OptionsTest, SlicesArePartsOfWholePixels) {
    const auto error = [](uint32_t number, uint32_t count, std::vector<std::filesystem::path> images) {
        return optionsError([&](RenderOptions& o) {
            o.slice = {number, count};
            o.output.images = std::move(images);
        });
    };
    const std::string needsParts = "--slice: needs -o *.part, and no other image";
    EXPECT_EQ(error(2, 3, {"a.part"}), "");
    EXPECT_EQ(error(2, 3, {}), needsParts);
    EXPECT_EQ(error(2, 3, {"a.part", "a.exr"}), needsParts);
    EXPECT_EQ(error(3, 3, {"a.part"}), "--slice: must be i/n with 1 <= i <= n <= 65536");
    EXPECT_EQ(error(0, 65537, {"a.part"}), "--slice: must be i/n with 1 <= i <= n <= 65536");
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.slice = {0, 2};
                  o.sampleRange = {0, 2};
                  o.output.images = {"a.part"};
              }),
              "--sample-range: does not go with --slice");
}

TEST(OptionsTest, OptionsThatRequireAnotherAreErrorsWithoutIt) {
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.progressive.resume = true; }),
              "--resume: needs --checkpoint");
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.progressive.errorCurve = "c.csv"; }),
              "--curve: needs --reference");
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.output.aovs = {Aov::Variance}; }),
              "--aov variance: needs --noise-target");
}

TEST(OptionsTest, ValuesOutOfRangeAreErrors) {
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.tileSize = 0; }), "--tile: must be at least 1");
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.progressive.timeLimit = -1; }),
              "--time-limit: must be finite and not negative");
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.sequence.emplace().frames.clear(); }),
              "--frames: must be at least one frame");
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.output.heatmapAov = Aov::Variance; }),
              "--heatmap-of: variance has no heat map");
    EXPECT_EQ(optionsError([](RenderOptions& o) { o.output.images = {"a.gif"}; }),
              "-o: \"a.gif\" must end in .exr, .png, .jpg, .jpeg, .tif, .tiff, .hdr or .part");
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.output.images = {"-.exr"};
                  o.sequence.emplace();
              }),
              "-o -: does not go with --frames");
    EXPECT_EQ(optionsError([](RenderOptions& o) {
                  o.output.images = {"a.exr"};
                  o.output.noImage = true;
              }),
              "-o: does not go with --no-output");
}

TEST(FrameTest, NumberReplacesPlaceholdersInFileNames) {
    for (const auto& [name, expected] : {std::pair("a.##.exr", "a.07.exr"),
                                         {"b_%03d_x.png", "b_007_x.png"},
                                         {"c%d.exr", "c7.exr"},
                                         {"d%4d.csv", "d   7.csv"},
                                         {"out/e.png", "out/e.0007.png"},
                                         {"", ""}})
        EXPECT_EQ(numberedFile(name, 7), expected);
    EXPECT_EQ(numberedFile("a.##.exr", 123), "a.123.exr");
}

TEST(FrameTest, ShutterIsInSceneTime) {
    const Shutter shutter = shutterOf({{3}, 4, 0.25, 0.75, false, ""}, 3);
    EXPECT_FLOAT_EQ(shutter.open, 3.25f / 4);
    EXPECT_FLOAT_EQ(shutter.close, 3.75f / 4);
}

} // namespace
} // namespace strobe::test
