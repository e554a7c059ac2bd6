// Light of rare bright samples on a plane of cells.
#include "sharing/rare_light.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace strobe {
namespace {

constexpr int kSize = 64;
constexpr LightPart kPart = LightPart::Indirect;
constexpr float kSamples = 16; ///< per cell

/// The plane z = 0, with cells of edge 1 that are as wide as a pixel, and samples above the limit.
struct Plane {
    std::vector<CellSums> cells; ///< in the order of `precedes`
    std::vector<PixelRareSample> samples;

    Plane() {
        for (int x = 0; x < kSize; ++x)
            for (int y = 0; y < kSize; ++y) {
                CellSums& sums = cells.emplace_back();
                sums.id = {7, x, y, 0, 0, 4};
                for (int k = 0; k < 2; ++k)
                    sums.p[k] = int64_t(kSamples) << (CellSums::kPositionBits - 1);
                sums.n[2] = int64_t(kSamples) << CellSums::kNormalBits;
                sums.count[0] = sums.count[1] = uint32_t(kSamples) / kHalves;
            }
        std::sort(cells.begin(), cells.end(),
                  [](const CellSums& a, const CellSums& b) { return precedes(a.id, b.id); });
    }
    CellPyramid pyramid() {
        const std::span<CellSums> tile = cells;
        return CellPyramid(joinCells({&tile, 1}).cells, LightParts::all());
    }
    uint32_t cellAt(int x, int y) const {
        const CellId id{7, x, y, 0, 0, 4};
        const auto cell =
            std::lower_bound(cells.begin(), cells.end(), id,
                             [](const CellSums& a, const CellId& b) { return precedes(a.id, b); });
        return uint32_t(cell - cells.begin());
    }
    void addSample(int x, int y, float light) {
        const RareSample sample{cellAt(x, y), uint8_t(kPart), false, Rgb(light), Rgb(1)};
        samples.push_back({sample, uint32_t(y * kSize + x), 0});
    }
};

TEST(RareLight, IsSpreadEvenly) {
    Plane plane;
    for (int y = 0; y < kSize; y += 8)
        for (int x = 0; x < kSize; x += 8)
            plane.addSample(x + (y * 5 / 8) % 8, y + (x * 3 / 8) % 8, 64 * kSamples);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    for (int y = 16; y < 48; ++y)
        for (int x = 16; x < 48; ++x) {
            const uint32_t cell = plane.cellAt(x, y);
            EXPECT_NEAR(rare.light(cell).x, 1, 0.25f) << x << " " << y;
        }
    EXPECT_GT(rare.rarity(plane.samples.front().cell), 0.98f);
}

/// Far cells are larger than near ones. Their largest regions contain the near ones.
TEST(RareLight, ReachesLargerCells) {
    Plane plane;
    for (const int x : {20, 40})
        for (const int y : {20, 40})
            plane.addSample(x, y, 64 * kSamples);
    CellSums far = plane.cells.front();
    far.id.x = 150;
    far.id.level = 1;
    plane.cells.push_back(far);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    const float mean = 4 * 64 * kSamples / (kSize * kSize * kSamples);
    EXPECT_NEAR(rare.light(uint32_t(pyramid.cellCount() - 1)).x, mean, 0.1f * mean);
}

/// One sample is much brighter than all others: it does not make a spot.
TEST(RareLight, RegionsHaveSeveralSamples) {
    Plane plane;
    for (int i = 0; i < kSize; i += 4)
        plane.addSample(i, (i * 7) % kSize, 10);
    plane.addSample(32, 32, 1e5f);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    const float mean = 1e5f / (kSamples * kSize * kSize);
    EXPECT_LT(rare.light(plane.cellAt(32, 32)).x, 4 * mean);
}

/// In a highlight each pixel has bright samples.
TEST(RareLight, HighlightsAreNotRare) {
    Plane plane;
    for (int y = 30; y < 34; ++y)
        for (int x = 30; x < 34; ++x)
            for (int i = 0; i < 8; ++i)
                plane.addSample(x, y, 10);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    EXPECT_EQ(rare.rarity(plane.cellAt(32, 32)), 0);
    EXPECT_EQ(rare.light(plane.cellAt(20, 20)).x, 0);
}

TEST(RareLight, IsBlackWithoutSamples) {
    Plane plane;
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), {}, kPart, kSamples);
    EXPECT_EQ(rare.light(0), Rgb(0));
}

TEST(RareLight, IgnoresOtherParts) {
    Plane plane;
    plane.addSample(20, 20, 64 * kSamples);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, LightPart::Direct, kSamples);
    EXPECT_TRUE(rare.isEmpty());
    EXPECT_EQ(rare.rarity(plane.cellAt(20, 20)), 0);
}

} // namespace
} // namespace strobe
