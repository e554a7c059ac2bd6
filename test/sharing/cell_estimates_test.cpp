// Cells of light at rest, and their fits.
#include "sharing/cell_estimates.h"

#include <gtest/gtest.h>

#include <random>

namespace strobe {
namespace {

/// Light that is linear on the plane z = 0.
Rgb linearLight(const V3f& p) { return Rgb(2 + 0.25f * p.x - 0.5f * p.y, 1 + p.x / 8, 3 - p.y / 16); }

constexpr LightPart kPart = LightPart::Indirect;

/// Returns the sums of a cell of the plane z = 0 with one sample per half, at its center. The direct light is
/// 1.
CellSums planeCell(int32_t x, int32_t y, const Rgb& first, const Rgb& second) {
    CellSums sums;
    sums.id = {7, x, y, 0, 0, 4};
    for (int k = 0; k < 2; ++k)
        sums.p[k] = int64_t(2) << (CellSums::kPositionBits - 1); // two samples
    sums.n[2] = int64_t(2) << CellSums::kNormalBits;
    sums.light[int(kPart)][0].add(first, 1);
    sums.light[int(kPart)][1].add(second, 1);
    for (PixelAccumulator& light : sums.light[int(LightPart::Direct)])
        light.add(Rgb(1), 1);
    return sums;
}

/// The estimates of cells by their handles.
class Estimates {
  public:
    explicit Estimates(const LightCells& cells) : m_pyramid(cells), m_estimates(estimateCells(m_pyramid)) {}
    const CellEstimate& of(uint32_t handle) const { return m_estimates[m_pyramid.cellOf(handle)]; }

  private:
    CellPyramid m_pyramid;
    std::vector<CellEstimate> m_estimates;
};

V3f centerOf(int32_t x, int32_t y) { return V3f(float(x) + 0.5f, float(y) + 0.5f, 0); }

TEST(CellId, ParentsContainTheirChildren) {
    const CellId id{7, -3, 5, -1, 2, 4};
    EXPECT_EQ(id.parent(), (CellId{7, -2, 2, -1, 3, 4}));
    EXPECT_NE(id.hash(), id.parent().hash());
}

TEST(CellSums, AddIsExact) {
    CellSums a = planeCell(0, 0, Rgb(1e-8f), Rgb(1e8f)), b = planeCell(0, 0, Rgb(1), Rgb(2));
    CellSums ab = a, ba = b;
    ab.add(b);
    ba.add(a);
    for (int half = 0; half < kHalves; ++half) {
        EXPECT_EQ(ab.light[int(kPart)][half], ba.light[int(kPart)][half]);
        EXPECT_EQ(ab.light[int(kPart)][half].validCount(), 2u);
    }
}

TEST(LightCells, HandlesAreStable) {
    LightCells cells;
    const uint32_t first = cells.add(planeCell(0, 0, Rgb(1), Rgb(1)));
    for (int32_t i = 1; i < 1000; ++i)
        EXPECT_NE(cells.add(planeCell(i, 0, Rgb(1), Rgb(1))), first);
    EXPECT_EQ(cells.add(planeCell(0, 0, Rgb(3), Rgb(1))), first);
    EXPECT_LT(first, cells.handleCount());
}

/// Ridges shrink derivatives by a tenth. Without derivatives, errors would be ten times as large.
TEST(CellEstimates, FitsReproduceLinearLight) {
    LightCells cells;
    constexpr int kSize = 24;
    uint32_t handles[kSize][kSize];
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const Rgb light = linearLight(centerOf(x, y));
            handles[y][x] = cells.add(planeCell(x, y, light, light * 2.f));
        }
    const Estimates estimates(cells);
    for (int y = 8; y < 16; ++y)
        for (int x = 8; x < 16; ++x) {
            const Rgb expected = linearLight(centerOf(x, y));
            const CellEstimate& estimate = estimates.of(handles[y][x]);
            for (int k = 0; k <= kFitScales; ++k)
                for (int c = 0; c < 3; ++c) {
                    const float tolerance = 0.04f * float(1 << k);
                    EXPECT_NEAR(estimate.at(k, kPart, 0)[c], expected[c], tolerance)
                        << x << " " << y << " " << k;
                    EXPECT_NEAR(estimate.at(k, kPart, 1)[c], 2 * expected[c], 2 * tolerance)
                        << x << " " << y << " " << k;
                    EXPECT_NEAR(estimate.at(k, LightPart::Direct, 1)[c], 1, 1e-4f);
                }
        }
}

TEST(CellEstimates, FitsAverageNoise) {
    LightCells cells;
    constexpr int kSize = 24;
    uint32_t handles[kSize][kSize];
    std::mt19937 random(1);
    std::exponential_distribution<float> noise(1);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            handles[y][x] = cells.add(planeCell(x, y, Rgb(noise(random)), Rgb(noise(random))));
    const Estimates estimates(cells);
    double squares[1 + kFitScales] = {};
    for (int y = 4; y < 20; ++y)
        for (int x = 4; x < 20; ++x)
            for (int k = 0; k <= kFitScales; ++k)
                squares[k] += sqr(estimates.of(handles[y][x]).at(k, kPart, 0).x - 1) / 256;
    EXPECT_NEAR(squares[0], 1, 0.35);
    for (int k = 1; k <= kFitScales; ++k)
        EXPECT_LT(squares[k], 0.5 * squares[k - 1]) << k;
}

TEST(CellEstimates, OppositeSidesDoNotShare) {
    LightCells cells;
    const uint32_t front = cells.add(planeCell(0, 0, Rgb(1), Rgb(1)));
    CellSums back = planeCell(0, 0, Rgb(9), Rgb(9));
    back.id.face = 5;
    back.n[2] *= -1;
    cells.add(back);
    const Estimates estimates(cells);
    for (int k = 0; k <= kFitScales; ++k)
        EXPECT_NEAR(estimates.of(front).at(k, kPart, 0).x, 1, 1e-4f);
}

TEST(CellEstimates, DoesNotDependOnTheOrderOfCells) {
    LightCells cells, reversed;
    uint32_t handles[2][100];
    for (int i = 0; i < 100; ++i) {
        const auto add = [](LightCells& to, int k) {
            return to.add(planeCell(k % 10, k / 10, Rgb(float(k % 7)), Rgb(float(k % 5))));
        };
        handles[0][i] = add(cells, i);
        handles[1][99 - i] = add(reversed, 99 - i);
    }
    const Estimates a(cells), b(reversed);
    for (int i = 0; i < 100; ++i)
        for (int k = 0; k <= kFitScales; ++k)
            for (int half = 0; half < kHalves; ++half)
                EXPECT_EQ(a.of(handles[0][i]).at(k, kPart, half), b.of(handles[1][i]).at(k, kPart, half));
}

} // namespace
} // namespace strobe
