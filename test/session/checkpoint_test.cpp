#include "session_fixture.h"

namespace strobe::test {
namespace {

class CheckpointTest : public SessionTest {
  protected:
    /// Interrupts a render and resumes it with other tiles. The image equals that of an uninterrupted render.
    void interruptAndResume() {
        renderScene(writing({"whole.exr"}), log);
        RenderOptions o = withCheckpoint();
        interrupt(o);
        EXPECT_TRUE(exists("o.exr.checkpoint"));
        EXPECT_TRUE(hasMessage(LogLevel::Warning, "stopped; --resume continues"));
        EXPECT_NE(pixels("o.exr"), pixels("whole.exr"));
        o.progressive.resume = true;
        o.threads = 2;
        o.tileSize = 5;
        EXPECT_EQ(renderScene(o, log), Outcome::Finished);
        EXPECT_EQ(pixels("o.exr"), pixels("whole.exr"));
        EXPECT_FALSE(exists("o.exr.checkpoint"));
    }
    RenderOptions withCheckpoint() const {
        RenderOptions o = writing({"o.exr"});
        o.progressive.checkpointInterval = 1000;
        return o;
    }
    /// Stops a render at half of the image.
    void interrupt(const RenderOptions& o) {
        RenderControl control;
        EXPECT_EQ(renderScene(o, log, atHalf(control, [&] { control.stop(); })), Outcome::Interrupted);
    }
};

TEST_F(CheckpointTest, ResumedImageEqualsAnUninterruptedOne) { interruptAndResume(); }

/// Finished pixels stay, with the records of their tiles.
TEST_F(CheckpointTest, ResumesWithRecords) {
    useAdaptiveCache();
    interruptAndResume();
}

TEST_F(CheckpointTest, IsSavedOnRequest) {
    RenderControl control;
    control.saveCheckpoint(); // no render runs
    bool isSaved = false;
    EXPECT_EQ(renderScene(withCheckpoint(), log,
                          atHalf(control,
                                 [&] {
                                     control.saveCheckpoint();
                                     isSaved = exists("o.exr.checkpoint");
                                 })),
              Outcome::Finished);
    EXPECT_TRUE(isSaved);
    control.saveCheckpoint();
    EXPECT_FALSE(exists("o.exr.checkpoint"));
}

TEST_F(CheckpointTest, IsNotOverwrittenWithoutResume) {
    interrupt(withCheckpoint());
    EXPECT_EQ(usageError([&] { renderScene(withCheckpoint(), log); }),
              path("o.exr.checkpoint").string() +
                  " exists: continue from it with --resume, or remove it to start anew");
}

TEST_F(CheckpointTest, OfAnotherRenderIsAnError) {
    RenderOptions o = withCheckpoint();
    interrupt(o);
    o.progressive.resume = true;
    o.seed = 3;
    EXPECT_EQ(usageError([&] { renderScene(o, log); }),
              path("o.exr.checkpoint").string() + ": it is a part of another render: seed is 0, not 3");
}

TEST_F(CheckpointTest, ResumeWithoutACheckpointStartsAnew) {
    RenderOptions o = withCheckpoint();
    o.progressive.resume = true;
    EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Info, "there is no checkpoint to resume from"));
}

} // namespace
} // namespace strobe::test
