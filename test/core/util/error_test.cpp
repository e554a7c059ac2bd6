#include "core/util/error.h"

#include <gtest/gtest.h>

#include <vector>

using namespace strobe;

namespace {

Location at(std::string text, size_t offset) {
    const auto owner = std::make_shared<std::string>(std::move(text));
    return {std::make_shared<Source>("dir/a.scene", *owner, owner, "dir"), offset};
}

TEST(Location, CountsLinesAndColumns) {
    const std::string text = "ab\ncd\n";
    const std::vector<std::pair<int, int>> wanted{{1, 1}, {1, 2}, {1, 3}, {2, 1},
                                                  {2, 2}, {2, 3}, {3, 1}, {3, 1}};
    for (size_t i = 0; i < wanted.size(); ++i)
        EXPECT_EQ(at(text, i).lineColumn(), wanted[i]) << i;
    EXPECT_EQ(at(text, 4).toString(), "dir/a.scene:2:2");
    EXPECT_EQ(Location{}.toString(), "");
    EXPECT_FALSE(Location{});
    EXPECT_EQ(at("", 0).toString(), "dir/a.scene:1:1");
}

TEST(Location, CountsLinesOfLargeTexts) {
    std::string text(20000, 'x');
    for (size_t i = 0; i < text.size(); i += 1 + i % 97)
        text[i] = '\n';
    const Location somewhere = at(text, 0);
    for (size_t i = 0, lines = 0; i <= text.size(); lines += i < text.size() && text[i] == '\n', ++i)
        ASSERT_EQ(somewhere.source->linesBefore(i), lines) << i;
    EXPECT_EQ(at(text, 1 << 20).lineColumn(), at(text, text.size()).lineColumn());
}

TEST(Diagnostic, ShowsTheLineAndACaret) {
    EXPECT_EQ(formatDiagnostic(at("one\n\tShape \"x\"\r\nend", 11), "error", "no"),
              "dir/a.scene:2:8: error: no\n"
              "   Shape \"x\"\n"
              "         ^");
    EXPECT_EQ(formatDiagnostic({}, "warning", "hm"), "warning: hm");
    EXPECT_EQ(formatDiagnostic(at("", 0), "error", "empty"), "dir/a.scene:1:1: error: empty\n  \n  ^");
    EXPECT_EQ(formatDiagnostic(at("a\x01\xc3\xa4z", 4), "error", "b"),
              "dir/a.scene:1:5: error: b\n  a???z\n      ^");
}

TEST(Diagnostic, CutsLongLinesAroundTheCaret) {
    std::string text(1000, 'a');
    text[500] = 'X';
    const std::string shown = formatDiagnostic(at(text, 500), "error", "m");
    EXPECT_EQ(shown, "dir/a.scene:1:501: error: m\n  ..." + std::string(70, 'a') + "X" +
                         std::string(39, 'a') + "...\n  " + std::string(73, ' ') + "^");
    EXPECT_EQ(formatDiagnostic(at(std::string(200, 'b'), 3), "error", "m"),
              "dir/a.scene:1:4: error: m\n  " + std::string(110, 'b') + "...\n     ^");
}

TEST(Diagnostics, ReportsEachOnce) {
    std::vector<std::string> seen;
    Diagnostics messages([&](const std::string& m) { seen.push_back(m); });
    messages.warn(at("ab", 0), "x");
    messages.warn(at("ab", 0), "x");
    messages.warn(at("ab", 1), "x");
    messages.warnOnce("key", at("ab", 0), "first");
    messages.warnOnce("key", at("ab", 1), "second");
    ASSERT_EQ(seen.size(), 3u);
    EXPECT_EQ(messages.count(), 3);
    EXPECT_EQ(seen[2], "dir/a.scene:1:1: warning: first\n  ab\n  ^");
    Diagnostics quiet;
    quiet.warn({}, "y");
    EXPECT_EQ(quiet.count(), 1);
}

TEST(EditDistance, KnownValues) {
    EXPECT_EQ(editDistance("", ""), 0u);
    EXPECT_EQ(editDistance("", "abc"), 3u);
    EXPECT_EQ(editDistance("abc", ""), 3u);
    EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
    EXPECT_EQ(editDistance("Shpae", "Shape"), 1u);
    EXPECT_EQ(editDistance("ca", "abc"), 3u);
    EXPECT_EQ(editDistance(std::string(100, 'a'), "aaa"), 100u);
}

TEST(NearestName, FindsResemblancesOnly) {
    const std::vector<std::string> names{"sphere", "disk", "trianglemesh"};
    EXPECT_EQ(nearestName("shpere", names), "sphere");
    EXPECT_EQ(nearestName("trianglemseh", names), "trianglemesh");
    EXPECT_EQ(nearestName("zzz", names), "");
}

} // namespace
