// Decisions of adaptive-cache by the errors of blocks.
#include "sharing/pilots/verdict.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

const LightParts kNone{}, kDirect = kSharingChoices[kSharesDirect],
                          kIndirect = kSharingChoices[kSharesIndirect], kBoth = kSharingChoices[kSharesBoth];
const PilotedLight kMuchIndirect{LightParts::all(), 3}, kLittleIndirect{LightParts::all(), 1.1};

/// Returns a block with these errors by kSharingChoices.
BlockPilot blockWith(double none, double direct, double indirect, double both) {
    BlockPilot block;
    block.errors[0] = none;
    block.errors[kSharesDirect] = direct;
    block.errors[kSharesIndirect] = indirect;
    block.errors[kSharesBoth] = both;
    return block;
}

/// Returns a block with an error of 1 without sharing, or with shared direct light.
BlockPilot blockWith(double indirect, double both) { return blockWith(1, 1, indirect, both); }

/// Returns blocks whose direct light has these errors without and with sharing.
std::vector<BlockPilot> directBlocks(size_t count, double shared, double oddOwn, double oddShared) {
    std::vector<BlockPilot> blocks(count, blockWith(1, shared, 1, shared));
    blocks[1] = blockWith(oddOwn, oddShared, oddOwn, oddShared);
    return blocks;
}

Verdict decide(const std::vector<BlockPilot>& blocks, const PilotedLight& light = kMuchIndirect) {
    return decideSharing(blocks, light, 0.5, 1);
}

TEST(Verdict, SharesPartsThatGainMoreThanTheirTime) {
    EXPECT_EQ(decide({5, blockWith(0.2, 0.1)}).parts, kBoth);
    EXPECT_EQ(decide({5, blockWith(0.2, 0.22)}).parts, kIndirect);
    EXPECT_EQ(decide({5, blockWith(0.2, 0.2)}).parts, kIndirect); // a gain of 0 does not pay its time
    EXPECT_EQ(decide({5, blockWith(0.8, 0.8)}).parts, kNone);
    EXPECT_EQ(decide({5, blockWith(0.2, 0.1)}, kLittleIndirect).parts, kBoth);
    EXPECT_EQ(decide({5, blockWith(0.8, 0.8)}, kLittleIndirect).parts, kNone);
}

/// The blocks lose by one standard error.
TEST(Verdict, IndirectLightWithMuchNoiseIsSharedUnlessBlocksLoseClearly) {
    std::vector<BlockPilot> blocks(5, blockWith(1, 1));
    blocks[2] = blockWith(0.5, 0.5);
    const Verdict much = decide(blocks), little = decide(blocks, kLittleIndirect);
    EXPECT_EQ(much.parts, kIndirect);
    EXPECT_FALSE(much.isCertain);
    EXPECT_EQ(little.parts, kNone);
    EXPECT_TRUE(little.isCertain);
}

TEST(Verdict, DirectLightBesideIndirectMayLoseHalfOfAStandardError) {
    std::vector<BlockPilot> blocks(5, blockWith(0.2, 0.2));
    blocks[1] = blockWith(0.2, 0.15);
    EXPECT_EQ(decide(blocks).parts, kBoth);
    blocks[3] = blockWith(0.2, 0.3);
    EXPECT_EQ(decide(blocks).parts, kIndirect);
}

TEST(Verdict, BlackPartsAreNotShared) {
    EXPECT_EQ(decide({5, blockWith(0.2, 0.1)}, {kIndirect, 3}).parts, kIndirect);
    EXPECT_EQ(decide(directBlocks(5, 0.2, 1, 0.2), {kDirect, 1}).parts, kDirect);
}

TEST(Verdict, DirectLightAloneMustGainAStandardError) {
    const auto decideWith = [](double oddShared) {
        return decide(directBlocks(5, 0.3, 1, oddShared), {kDirect, 1});
    };
    const Verdict gains = decideWith(1.3), unclear = decideWith(2.3), loses = decideWith(5);
    EXPECT_EQ(gains.parts, kDirect);
    EXPECT_TRUE(gains.isCertain);
    EXPECT_EQ(unclear.parts, kNone);
    EXPECT_FALSE(unclear.isCertain);
    EXPECT_EQ(loses.parts, kNone);
    EXPECT_TRUE(loses.isCertain);
}

/// The roots gain 2.3 standard errors, the errors 0.48.
TEST(Verdict, DirectLightAloneMustGainInTheErrorsToo) {
    EXPECT_EQ(decide(directBlocks(10, 0.3, 4, 5), {kDirect, 1}).parts, kNone);
    EXPECT_EQ(decide(directBlocks(10, 0.3, 4, 4.5), {kDirect, 1}).parts, kDirect);
}

TEST(Verdict, RendersOfManySamplesNeedMoreGain) {
    const std::vector<BlockPilot> blocks(5, blockWith(1, 0.25, 0.3, 0.25));
    const auto decideWith = [&](const PilotedLight& light, double sampleRatio) {
        return decideSharing(blocks, light, 0.5, sampleRatio).parts;
    };
    EXPECT_EQ(decideWith(kMuchIndirect, 1), kBoth);
    EXPECT_EQ(decideWith(kMuchIndirect, 0.5), kBoth);
    EXPECT_EQ(decideWith(kMuchIndirect, 0.02), kNone);
    const PilotedLight direct{kDirect, 1};
    EXPECT_EQ(decideWith(direct, 1), kDirect);
    EXPECT_EQ(decideWith(direct, 0.5), kNone); // direct light converges faster
}

} // namespace
} // namespace strobe
