#include "core/util/diagnostics.h"

#include <gtest/gtest.h>

using namespace strobe;

namespace {

/// Returns the location at `offset` in a source text dir/a.scene.
Location at(std::string text, size_t offset) {
    const auto owner = std::make_shared<std::string>(std::move(text));
    return {std::make_shared<Source>("dir/a.scene", *owner, owner, "dir"), offset};
}

TEST(FormatDiagnostic, ShowsTheLineAndACaret) {
    EXPECT_EQ(formatDiagnostic(at("one\n\tShape \"x\"\r\nend", 11), "error", "no"),
              "dir/a.scene:2:8: error: no\n"
              "   Shape \"x\"\n"
              "         ^");
    EXPECT_EQ(formatDiagnostic({}, "warning", "hm"), "warning: hm");
    EXPECT_EQ(formatDiagnostic(at("", 0), "error", "empty"), "dir/a.scene:1:1: error: empty\n  \n  ^");
    EXPECT_EQ(formatDiagnostic(at("a\x01\xc3\xa4z", 4), "error", "b"),
              "dir/a.scene:1:5: error: b\n  a???z\n      ^");
}

TEST(FormatDiagnostic, CutsLongLinesAroundTheCaret) {
    std::string text(1000, 'a');
    text[500] = 'X';
    const std::string shown = formatDiagnostic(at(text, 500), "error", "m");
    EXPECT_EQ(shown, "dir/a.scene:1:501: error: m\n  ..." + std::string(70, 'a') + "X" +
                         std::string(39, 'a') + "...\n  " + std::string(73, ' ') + "^");
    EXPECT_EQ(formatDiagnostic(at(std::string(200, 'b'), 3), "error", "m"),
              "dir/a.scene:1:4: error: m\n  " + std::string(110, 'b') + "...\n     ^");
}

TEST(Diagnostics, ReportsEachWarningOnce) {
    std::vector<std::string> seen;
    Diagnostics diagnostics([&](const std::string& m) { seen.push_back(m); });
    diagnostics.warn(at("ab", 0), "x");
    diagnostics.warn(at("ab", 0), "x");
    diagnostics.warn(at("ab", 1), "x");
    diagnostics.warnOnce("key", at("ab", 0), "first");
    diagnostics.warnOnce("key", at("ab", 1), "second");
    ASSERT_EQ(seen.size(), 3u);
    EXPECT_EQ(diagnostics.count(), 3);
    EXPECT_EQ(seen[2], "dir/a.scene:1:1: warning: first\n  ab\n  ^");
    Diagnostics quiet;
    quiet.warn({}, "y");
    EXPECT_EQ(quiet.count(), 1);
}

TEST(Diagnostics, RecorderReplaysItsWarnings) {
    Diagnostics recorder = Diagnostics::recorder();
    recorder.warn(at("ab", 0), "x");
    recorder.warnOnce("key", at("ab", 1), "y");
    recorder.warnOnce("key", at("ab", 1), "z");
    std::vector<std::string> seen;
    Diagnostics diagnostics([&](const std::string& m) { seen.push_back(m); });
    recorder.replayTo(diagnostics);
    ASSERT_EQ(seen.size(), 2u);
    EXPECT_EQ(seen[0], "dir/a.scene:1:1: warning: x\n  ab\n  ^");
    EXPECT_EQ(seen[1], "dir/a.scene:1:2: warning: y\n  ab\n   ^");
}

} // namespace
