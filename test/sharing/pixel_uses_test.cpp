// Uses of cells by pixel.
#include "sharing/pixel_uses.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Two passes of pixels 0 … 2.
const std::vector<std::vector<CellUse>> kBatches = {
    {{2, 5, 0, Rgb(1)}, {2, 6, 0, Rgb(2)}}, {{0, 5, 1, Rgb(3)}}, {{2, 5, 0, Rgb(4)}, {2, 5, 1, Rgb(8)}}};

TEST(PixelUses, KeepsTheOrderWithinAPixel) {
    const PixelUses uses(kBatches, 3);
    ASSERT_EQ(uses.of(0).size(), 1u);
    EXPECT_EQ(uses.of(1).size(), 0u);
    ASSERT_EQ(uses.of(2).size(), 4u);
    for (size_t i = 0; i < 4; ++i)
        EXPECT_EQ(uses.of(2)[i].albedo, Rgb(float(1 << i)));
}

TEST(PixelUses, MergesPixelHalfAndCell) {
    const std::vector<CellUse> uses = merged(kBatches, 3);
    ASSERT_EQ(uses.size(), 4u);
    EXPECT_EQ(uses[0].albedo, Rgb(3));
    EXPECT_EQ(uses[1].albedo, Rgb(1 + 4));
    EXPECT_EQ(uses[2].cell, 6u);
    EXPECT_EQ(uses[3].half, 1u);
}

} // namespace
} // namespace strobe
