// Cells of light at rest, and their fits.
#include "sharing/cell_estimates.h"

#include <gtest/gtest.h>

#include <map>
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
    sums.count[0] = sums.count[1] = 1;
    sums.light[int(kPart)][0].add(first);
    sums.light[int(kPart)][1].add(second);
    for (RgbSum& light : sums.light[int(LightPart::Direct)])
        light.add(Rgb(1));
    return sums;
}

/// Cells in the order of `precedes`.
class Cells {
  public:
    void add(const CellSums& sums) { m_cells.emplace(sums.id, sums); }
    std::vector<CellSums> all() const {
        std::vector<CellSums> all;
        for (const auto& [id, sums] : m_cells)
            all.push_back(sums);
        return all;
    }
    /// Returns the index of a cell in all().
    uint32_t index(const CellId& id) const {
        return uint32_t(std::distance(m_cells.begin(), m_cells.find(id)));
    }

  private:
    std::map<CellId, CellSums, decltype(&precedes)> m_cells{precedes};
};

CellEstimates estimatesOf(const Cells& cells, LightParts parts = LightParts::all()) {
    std::vector<CellSums> all = cells.all();
    const std::span<const CellSums> tile = all;
    const CellPyramid pyramid(joinCells({&tile, 1}).cells, parts);
    return estimateCells(pyramid, pyramid.cellsByNode());
}

CellId idOf(int32_t x, int32_t y) { return {7, x, y, 0, 0, 4}; }

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
        EXPECT_EQ(ab.count[half], 2u);
    }
}

/// Halves that are equal have no noise, so that derivatives are hardly shrunk.
TEST(CellEstimates, FitsReproduceLinearLight) {
    Cells cells;
    constexpr int kSize = 24;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const Rgb light = linearLight(centerOf(x, y));
            cells.add(planeCell(x, y, light, light));
        }
    const CellEstimates estimates = estimatesOf(cells);
    for (int y = 8; y < 16; ++y)
        for (int x = 8; x < 16; ++x) {
            const Rgb expected = linearLight(centerOf(x, y));
            const uint32_t cell = cells.index(idOf(x, y));
            const CellEstimate& estimate = estimates.parts[int(kPart)][cell];
            for (int k = 0; k <= kFitScales; ++k)
                for (int half = 0; half < kHalves; ++half)
                    for (int c = 0; c < 3; ++c) {
                        EXPECT_NEAR(estimate.at(k, half)[c], expected[c], 0.005f * float(1 << k))
                            << x << " " << y << " " << k;
                        EXPECT_NEAR(estimates.parts[int(LightPart::Direct)][cell].at(k, half)[c], 1, 1e-4f);
                    }
        }
}

/// Returns the x component of the normal of a cell of a rough plane, without relation to the position.
float tiltOf(int32_t x, int32_t y) { return 0.1f * float((7 * x + 5 * y + x * y) % 5 - 2); }

/// Returns the sums of a cell whose normal is tilted: see planeCell.
CellSums roughCell(int32_t x, int32_t y, const Rgb& first, const Rgb& second) {
    CellSums sums = planeCell(x, y, first, second);
    sums.n[0] = int64_t(2 * tiltOf(x, y) * float(1 << CellSums::kNormalBits));
    sums.n[2] = int64_t(2 * std::sqrt(1 - sqr(tiltOf(x, y))) * float(1 << CellSums::kNormalBits));
    return sums;
}

/// The mean squared errors of the estimates of a rough plane.
struct RoughErrors {
    double of[1 + kFitScales] = {};

    /// `light(x, y)`: of a sample; its expected value is 1 + slope tiltOf(x, y).
    template <class Light>
    RoughErrors(const Light& light, float slope) {
        constexpr int kSize = 24;
        Cells cells;
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x) {
                const float first = light(x, y), second = light(x, y);
                cells.add(roughCell(x, y, Rgb(first), Rgb(second)));
            }
        const CellEstimates estimates = estimatesOf(cells);
        for (int y = 4; y < 20; ++y)
            for (int x = 4; x < 20; ++x)
                for (int k = 0; k <= kFitScales; ++k) {
                    const CellEstimate& estimate = estimates.parts[int(kPart)][cells.index(idOf(x, y))];
                    of[k] += sqr(estimate.at(k, 0).x - (1 + slope * tiltOf(x, y))) / 256;
                }
    }
};

/// Light without noise that depends on the normal alone. The cells of the larger fit average the normals
/// away.
TEST(CellEstimates, FitsFollowNormals) {
    const RoughErrors errors([](int x, int y) { return 1 + tiltOf(x, y); }, 1);
    EXPECT_LT(errors.of[1], sqr(0.014)); // a tenth of the standard deviation of the light
}

/// Constant light with noise as large as the light. Derivatives by the normal that are not shrunk would
/// double the error of the smaller fit, and make that of the larger one five times as large.
TEST(CellEstimates, NoiseShrinksDerivatives) {
    std::mt19937 random(1);
    std::exponential_distribution<float> noise(1);
    const RoughErrors errors([&](int, int) { return noise(random); }, 0);
    EXPECT_LT(errors.of[1], 0.04);
    EXPECT_LT(errors.of[2], 0.012);
}

TEST(CellEstimates, FitsAverageNoise) {
    Cells cells;
    constexpr int kSize = 24;
    std::mt19937 random(1);
    std::exponential_distribution<float> noise(1);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            cells.add(planeCell(x, y, Rgb(noise(random)), Rgb(noise(random))));
    const CellEstimates estimates = estimatesOf(cells);
    double squares[1 + kFitScales] = {};
    for (int y = 4; y < 20; ++y)
        for (int x = 4; x < 20; ++x)
            for (int k = 0; k <= kFitScales; ++k)
                squares[k] += sqr(estimates.parts[int(kPart)][cells.index(idOf(x, y))].at(k, 0).x - 1) / 256;
    EXPECT_NEAR(squares[0], 1, 0.35);
    for (int k = 1; k <= kFitScales; ++k)
        EXPECT_LT(squares[k], 0.5 * squares[k - 1]) << k;
}

/// The mean squared errors of the widest fits in the middle of a plane, for light(x) with exponential noise.
template <class Light>
double errorOfWidestFit(const Light& light) {
    constexpr int kSize = 96;
    std::mt19937 random(1);
    std::exponential_distribution<float> noise(1);
    Cells cells;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            cells.add(planeCell(x, y, Rgb(light(x) * noise(random)), Rgb(light(x) * noise(random))));
    const CellEstimates estimates = estimatesOf(cells);
    double squares = 0;
    constexpr int kBorder = 16, kInside = kSize - 2 * kBorder;
    for (int y = kBorder; y < kSize - kBorder; ++y)
        for (int x = kBorder; x < kSize - kBorder; ++x) {
            const CellEstimate& estimate = estimates.parts[int(kPart)][cells.index(idOf(x, y))];
            squares += double(sqr(estimate.at(kFitScales, 0).x - light(x)));
        }
    return squares / (kInside * kInside);
}

/// By themselves, the fits have an error of 0.0073.
TEST(CellEstimates, SmoothLightIsAveragedBeyondItsFit) {
    EXPECT_LT(errorOfWidestFit([](int) { return 1.f; }), 0.004);
}

/// Stripes that wider fits would average: the fits have an error of 0.0235 by themselves, wider ones of 0.33.
TEST(CellEstimates, FitsKeepWhatWiderOnesLose) {
    EXPECT_LT(errorOfWidestFit([](int x) { return 1 + 0.8f * std::cos(float(x) * 0.2f); }), 0.026);
}

/// The estimates of a part do not depend on the other one.
TEST(CellEstimates, PartsAreIndependent) {
    Cells cells;
    constexpr int kSize = 12;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            cells.add(planeCell(x, y, Rgb(float(x * y % 5)), Rgb(float(x))));
    LightParts part;
    part.add(kPart);
    const CellEstimates both = estimatesOf(cells), one = estimatesOf(cells, part);
    EXPECT_TRUE(one.parts[int(LightPart::Direct)].empty());
    const auto &expected = both.parts[int(kPart)], &found = one.parts[int(kPart)];
    ASSERT_EQ(found.size(), expected.size());
    for (size_t cell = 0; cell < found.size(); ++cell)
        for (int k = 0; k <= kFitScales; ++k)
            for (int half = 0; half < kHalves; ++half)
                EXPECT_EQ(found[cell].at(k, half), expected[cell].at(k, half)) << cell << " " << k;
}

TEST(CellEstimates, OppositeSidesDoNotShare) {
    Cells cells;
    cells.add(planeCell(0, 0, Rgb(1), Rgb(1)));
    CellSums back = planeCell(0, 0, Rgb(9), Rgb(9));
    back.id.face = 5;
    back.n[2] *= -1;
    cells.add(back);
    const CellEstimates estimates = estimatesOf(cells);
    for (int k = 0; k <= kFitScales; ++k)
        EXPECT_NEAR(estimates.parts[int(kPart)][cells.index(idOf(0, 0))].at(k, 0).x, 1, 1e-4f);
}

/// The mean squared errors of the fits of a plane, by part of the light. Both parts have the same samples.
struct PartErrors {
    double of[kParts] = {};

    /// `light(x)`: without noise; the noise of a sample has a standard deviation of 0.1.
    template <class Light>
    explicit PartErrors(const Light& light) {
        constexpr int kSize = 40;
        std::mt19937 random(1);
        std::normal_distribution<float> noise(0, 0.1f);
        Cells cells;
        for (int y = 0; y < kSize; ++y)
            for (int x = 0; x < kSize; ++x) {
                const Rgb first(light(x) + noise(random)), second(light(x) + noise(random));
                CellSums sums = planeCell(x, y, first, second);
                for (int half = 0; half < kHalves; ++half)
                    sums.light[int(LightPart::Direct)][half] = sums.light[int(LightPart::Indirect)][half];
                cells.add(sums);
            }
        const CellEstimates estimates = estimatesOf(cells);
        for (int part = 0; part < kParts; ++part)
            for (int y = 8; y < kSize - 8; ++y)
                for (int x = 8; x < kSize - 8; ++x)
                    for (int k = 1; k <= kFitScales; ++k)
                        for (int half = 0; half < kHalves; ++half) {
                            const CellEstimate& estimate = estimates.parts[part][cells.index(idOf(x, y))];
                            of[part] += double(sqr(estimate.at(k, half).x - light(x)));
                        }
    }
    double ratio() const { return of[int(LightPart::Direct)] / of[int(LightPart::Indirect)]; }
};

/// The edge of a shadow, between cells of all sizes.
TEST(CellEstimates, DirectLightStaysWithinEdges) {
    EXPECT_LT(PartErrors([](int x) { return x < 16 ? 1.f : 0.7f; }).ratio(), 0.4);
}

TEST(CellEstimates, EvenDirectLightHasLittleMoreNoise) {
    EXPECT_LT(PartErrors([](int) { return 1.f; }).ratio(), 1.5);
    EXPECT_LT(PartErrors([](int x) { return 1 + 0.02f * float(x); }).ratio(), 1.5);
}

} // namespace
} // namespace strobe
