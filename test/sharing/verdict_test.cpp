// Decisions of adaptive-cache by the errors of blocks.
#include "sharing/pilots/verdict.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

const LightParts kNone{}, kIndirect = kSharingChoices[kSharesIndirect], kBoth = kSharingChoices[kSharesBoth];

/// Returns a block with an error of 1 without sharing, or with shared direct light.
BlockPilot blockWith(double indirect, double both) {
    BlockPilot block;
    for (auto& errors : block.errors) {
        errors[0] = errors[kSharesDirect] = 1;
        errors[kSharesIndirect] = indirect;
        errors[kSharesBoth] = both;
    }
    return block;
}

Verdict decide(const std::vector<BlockPilot>& blocks, const Overheads& overheads = {{0.5, 0.3}, false}) {
    return decideSharing(blocks, LightParts::all(), overheads, 1);
}

/// Returns blocks that disagree whether direct light should be shared.
std::vector<BlockPilot> disagreeing() {
    std::vector<BlockPilot> blocks(5, blockWith(0.2, 0.2));
    blocks[1] = blockWith(0.2, 0.1);
    blocks[3] = blockWith(0.2, 0.28);
    return blocks;
}

TEST(Verdict, SharesPartsThatGainMoreThanTheirTime) {
    EXPECT_EQ(decide({5, blockWith(0.2, 0.1)}).parts, kBoth);
    EXPECT_EQ(decide({5, blockWith(0.2, 0.22)}).parts, kIndirect);
    EXPECT_EQ(decide({5, blockWith(0.2, 0.2)}).parts, kIndirect); // a gain of 0 does not pay its time
    EXPECT_EQ(decide({5, blockWith(0.8, 0.8)}).parts, kNone);
}

TEST(Verdict, TheTimeIsThatOfAnAdaptiveRenderIfSamplesAdapt) {
    const std::vector<BlockPilot> blocks(5, blockWith(0.5, 0.5));
    EXPECT_EQ(decide(blocks, {{1.2, 0.5}, false}).parts, kNone);
    EXPECT_EQ(decide(blocks, {{1.2, 0.5}, true}).parts, kIndirect);
}

TEST(Verdict, IsUncertainIfBlocksDisagreeAboutDirectLight) {
    const Verdict agreed = decide({5, blockWith(0.2, 0.19)});
    EXPECT_EQ(agreed.parts, kBoth);
    EXPECT_TRUE(agreed.isCertain);
    const Verdict verdict = decide(disagreeing());
    EXPECT_EQ(verdict.parts, kBoth);
    EXPECT_FALSE(verdict.isCertain);
}

TEST(Verdict, BlackDirectLightIsCertain) {
    LightParts indirect;
    indirect.add(LightPart::Indirect);
    const Verdict verdict = decideSharing(disagreeing(), indirect, {{0.5, 0.3}, false}, 1);
    EXPECT_EQ(verdict.parts, kIndirect);
    EXPECT_TRUE(verdict.isCertain);
}

/// Blocks that gain on average ask for more blocks, blocks that lose do not. Beside indirect light, both ask.
TEST(Verdict, ARefusalOfDirectLightAloneIsCertainIfBlocksLose) {
    LightParts direct;
    direct.add(LightPart::Direct);
    std::vector<BlockPilot> blocks(5, blockWith(1, 1));
    const auto decideWith = [&](LightParts lit, double least, double most) {
        for (size_t i = 0; i < blocks.size(); ++i)
            for (auto& errors : blocks[i].errors)
                errors[kSharesDirect] = errors[kSharesBoth] = i == 0 ? most : least;
        return decideSharing(blocks, lit, {{0.5, 0.3}, false}, 1);
    };
    const Verdict gains = decideWith(direct, 0.3, 1.3), loses = decideWith(direct, 0.3, 2.3);
    EXPECT_EQ(gains.parts, kNone);
    EXPECT_FALSE(gains.isCertain);
    EXPECT_EQ(loses.parts, kNone);
    EXPECT_TRUE(loses.isCertain);
    EXPECT_FALSE(decideWith(LightParts::all(), 0.3, 2.3).isCertain);
}

/// One of five blocks loses, so that the sum of the errors does not show a gain. The roots show one of 0.6
/// standard errors.
TEST(Verdict, RootsOfErrorsNeedAStandardErrorIfSamplesDoNotAdapt) {
    std::vector<BlockPilot> blocks(5, blockWith(0.25, 0.25));
    blocks[2] = blockWith(1.44, 1.44);
    EXPECT_EQ(decide(blocks, {{0.9, 0.6}, false}).parts, kNone);
    EXPECT_EQ(decide(blocks, {{0.9, 0.6}, true}).parts, kIndirect);
    blocks[2] = blockWith(0.9, 0.9);
    EXPECT_EQ(decide(blocks, {{0.9, 0.6}, false}).parts, kIndirect);
}

TEST(Verdict, RendersOfManySamplesNeedMoreGain) {
    const std::vector<BlockPilot> blocks(5, blockWith(0.3, 0.3));
    const Overheads overheads{{0.5, 0.3}, false};
    EXPECT_EQ(decideSharing(blocks, LightParts::all(), overheads, 1).parts, kIndirect);
    EXPECT_EQ(decideSharing(blocks, LightParts::all(), overheads, 0.1).parts, kNone);
}

} // namespace
} // namespace strobe
