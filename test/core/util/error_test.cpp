#include "core/util/error.h"

#include <gtest/gtest.h>

#include <vector>

using namespace strobe;

namespace {

/// Returns the location at `offset` in a source text dir/a.scene.
Location at(std::string text, size_t offset) {
    const auto owner = std::make_shared<std::string>(std::move(text));
    return {std::make_shared<Source>("dir/a.scene", *owner, owner, "dir"), offset};
}

TEST(Location, CountsLinesAndColumns) {
    const std::string text = "ab\ncd\n";
    const std::vector<std::pair<int, int>> expected{{1, 1}, {1, 2}, {1, 3}, {2, 1},
                                                    {2, 2}, {2, 3}, {3, 1}, {3, 1}};
    for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(at(text, i).lineColumn(), expected[i]) << i;
    EXPECT_EQ(at(text, 4).toString(), "dir/a.scene:2:2");
    EXPECT_EQ(Location{}.toString(), "");
    EXPECT_FALSE(Location{});
    EXPECT_EQ(at("", 0).toString(), "dir/a.scene:1:1");
}

TEST(Location, CountsLinesInLargeTexts) {
    std::string text(20000, 'x');
    for (size_t i = 0; i < text.size(); i += 1 + i % 97)
        text[i] = '\n';
    const Location location = at(text, 0);
    for (size_t i = 0, lines = 0; i <= text.size(); lines += i < text.size() && text[i] == '\n', ++i)
        ASSERT_EQ(location.source->linesBefore(i), lines) << i;
    EXPECT_EQ(at(text, 1 << 20).lineColumn(), at(text, text.size()).lineColumn());
}

} // namespace
