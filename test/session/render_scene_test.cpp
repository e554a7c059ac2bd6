#include "session_fixture.h"

#include <fstream>

namespace strobe::test {
namespace {

using RenderSceneTest = SessionTest;

TEST_F(RenderSceneTest, WritesAllOutputs) {
    RenderOptions o = writing({"a.exr", "a.png", "a.part"});
    o.output.stats = path("a.json");
    EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    for (const char* name : {"a.exr", "a.png", "a.part", "a.json"})
        EXPECT_TRUE(exists(name)) << name;
    EXPECT_EQ(pixels("a.exr").size(), 24u * 16u);
    EXPECT_EQ(pixels("a.png").size(), 24u * 16u);
    EXPECT_EQ(attribute("a.exr", "strobe:integrator"), "supersample");
}

TEST_F(RenderSceneTest, MessagesGoToTheSink) {
    RenderOptions o = writing({"a.png"});
    o.output.aovs = {Aov::Normal};
    renderScene(o, log);
    EXPECT_TRUE(hasMessage(LogLevel::Debug, "parsed in"));
    EXPECT_TRUE(hasMessage(LogLevel::Info, "24x16 pixels, 8 spp"));
    EXPECT_TRUE(hasMessage(LogLevel::Info, "wrote " + path("a.png").string()));
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "--aov: there is no .exr output to hold the layers"));
    renderScene(writing({"b.png"}), Log{}); // without a sink messages are discarded
}

TEST_F(RenderSceneTest, ProgressRisesFromZeroToOne) {
    std::vector<double> fractions;
    int rendered = 0;
    RenderCallbacks callbacks;
    callbacks.onProgress = [&](double fraction) { fractions.push_back(fraction); };
    callbacks.onRendered = [&] { ++rendered; };
    renderScene(writing({"a.exr"}), log, callbacks);
    EXPECT_EQ(rendered, 1);
    ASSERT_GT(fractions.size(), 2u);
    EXPECT_EQ(fractions.front(), 0);
    EXPECT_EQ(fractions.back(), 1);
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
}

TEST_F(RenderSceneTest, PixelEqualsThatOfTheImage) {
    renderScene(writing({"a.exr"}), log);
    const PixelResult result = renderPixel(options, {{12, 8}, {}}, log);
    EXPECT_EQ(result.value, pixels("a.exr")[8 * 24 + 12]);
    EXPECT_EQ(result.invalidSamples, 0u);
    EXPECT_EQ(usageError([&] {
                  renderPixel(options, {{24, 0}, {}}, log);
              }),
              "--pixel 24,0: the frame has 24x16 pixels");
    EXPECT_EQ(usageError([&] {
                  renderPixel(options, {{0, 0}, 8}, log);
              }),
              "--sample 8: a pixel has 8 samples");
    EXPECT_EQ(usageError([&] {
                  renderPixel(writing({"b.exr"}), {{0, 0}, {}}, log);
              }),
              "-o: does not go with --pixel");
}

TEST_F(RenderSceneTest, InvalidSamplesAreAnOutcomeIfStrict) {
    std::ofstream(options.scenes.front(), std::ios::app) << R"(
AreaLightSource "diffuse" "rgb L" [1e30 1e30 1e30]
Shape "sphere" "float radius" 1
)";
    RenderOptions o = writing({"a.exr"});
    EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    EXPECT_TRUE(
        hasMessage(LogLevel::Warning, "samples were NaN, infinite or beyond 2.8e14 and are left out"));
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "replay with --pixel "));
    o.strict = true;
    EXPECT_EQ(renderScene(o, log), Outcome::InvalidSamples);
    EXPECT_TRUE(hasMessage(LogLevel::Error, "samples were NaN"));
}

TEST_F(RenderSceneTest, FinishedFramesAreSkipped) {
    RenderOptions o = writing({"f.##.exr"});
    o.sequence = SequenceOptions{{1, 3}, 24, 0, 0.5, false, "settings"};
    EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Info, "2 frames: 2 rendered now, 0 before"));
    EXPECT_TRUE(exists("f.01.exr") && exists("f.03.exr"));
    EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Info, "2 frames: 0 rendered now, 2 before"));
    o.sequence->settings = "other settings";
    messages.clear();
    renderScene(o, log);
    EXPECT_TRUE(hasMessage(LogLevel::Info, "2 frames: 2 rendered now, 0 before"));
}

TEST_F(RenderSceneTest, StopEndsASequence) {
    RenderOptions o = writing({"f.#.exr"});
    o.sequence = SequenceOptions{{1, 2, 3}, 24, 0, 0.5, false, ""};
    RenderControl control;
    EXPECT_EQ(renderScene(o, log, atHalf(control, [&] { control.stop(); })), Outcome::Interrupted);
    EXPECT_EQ(attribute("f.1.exr", "strobe:frameKey"), "");
    EXPECT_FALSE(exists("f.2.exr"));
}

TEST_F(RenderSceneTest, UnwritableOutputsAreErrorsBeforeRendering) {
    RenderOptions o = writing({"none/a.exr"});
    try {
        renderScene(o, log);
        ADD_FAILURE() << "no error";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind, ErrorKind::Output);
    }
    EXPECT_EQ(usageError([&] {
                  renderScene(writing({"a.exr", "./a.exr"}), log);
              }),
              "\"" + path("./a.exr").string() + "\" is to be written twice");
    o.scenes.clear();
    EXPECT_EQ(usageError([&] { renderScene(o, log); }), "there is no scene file");
}

} // namespace
} // namespace strobe::test
