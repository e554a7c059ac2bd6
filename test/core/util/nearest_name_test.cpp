#include "core/util/nearest_name.h"

#include <gtest/gtest.h>

using namespace strobe;

namespace {

TEST(EditDistance, HasKnownValues) {
    EXPECT_EQ(editDistance("", ""), 0u);
    EXPECT_EQ(editDistance("", "abc"), 3u);
    EXPECT_EQ(editDistance("abc", ""), 3u);
    EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
    EXPECT_EQ(editDistance("Shpae", "Shape"), 1u);
    EXPECT_EQ(editDistance("ca", "abc"), 3u);
    EXPECT_EQ(editDistance(std::string(100, 'a'), "aaa"), 100u);
}

TEST(NearestName, IsEmptyUnlessANameIsSimilar) {
    const std::vector<std::string> names{"sphere", "disk", "trianglemesh"};
    EXPECT_EQ(nearestName("shpere", names), "sphere");
    EXPECT_EQ(nearestName("trianglemseh", names), "trianglemesh");
    EXPECT_EQ(nearestName("zzz", names), "");
}

} // namespace
