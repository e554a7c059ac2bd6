// Light of rare bright samples on a plane of cells.
#include "sharing/rare_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace strobe {
namespace {

constexpr int kSize = 64;
constexpr LightPart kPart = LightPart::Indirect;
constexpr float kSamples = 16; ///< per cell

/// Cells of edge 1, and samples above the limit.
struct Surface {
    std::vector<CellSums> cells; ///< in the order of `precedes`
    std::vector<PixelRareSample> samples;

    void sort() {
        std::sort(cells.begin(), cells.end(),
                  [](const CellSums& a, const CellSums& b) { return precedes(a.id, b.id); });
    }
    CellPyramid pyramid() {
        const std::span<const CellSums> tile = cells;
        return CellPyramid(joinCells({&tile, 1}).cells, LightParts::all());
    }
    /// Adds light below the limit, per sample.
    void addOtherLight(float light) {
        for (CellSums& sums : cells)
            for (int half = 0; half < kHalves; ++half)
                sums.light[int(kPart)][half].add(Rgb(light * float(sums.count[half])));
    }
    void addSample(uint32_t cell, float light) {
        const RareSample sample{cell, uint8_t(kPart), false, Rgb(light), Rgb(1)};
        samples.push_back({sample, cell, 0});
    }
};

/// The plane z = 0, with cells that are as wide as a pixel.
struct Plane : Surface {
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
        sort();
    }
    uint32_t cellAt(int x, int y) const {
        const CellId id{7, x, y, 0, 0, 4};
        const auto cell =
            std::lower_bound(cells.begin(), cells.end(), id,
                             [](const CellSums& a, const CellId& b) { return precedes(a.id, b); });
        return uint32_t(cell - cells.begin());
    }
    using Surface::addSample;
    void addSample(int x, int y, float light) { addSample(cellAt(x, y), light); }
};

/// Squares of 8x8 cells, each a surface of its own.
struct Squares : Surface {
    static constexpr int kCells = 64; ///< of a square

    explicit Squares(int count) {
        const Plane plane;
        for (int surface = 0; surface < count; ++surface)
            for (int i = 0; i < kCells; ++i) {
                cells.push_back(plane.cells[plane.cellAt(i % 8, i / 8)]);
                cells.back().id.surface = uint64_t(surface);
            }
        sort();
    }
    uint32_t firstCell(int surface) const {
        const auto cell = std::find_if(cells.begin(), cells.end(), [&](const CellSums& sums) {
            return sums.id.surface == uint64_t(surface);
        });
        return uint32_t(cell - cells.begin());
    }
};

/// A sphere around the origin with even samples.
struct Sphere : Surface {
    static constexpr float kRadius = 20;

    Sphere() {
        constexpr int kCount = 80000;
        std::map<std::tuple<int, int, int, int>, CellSums> sums;
        for (int i = 0; i < kCount; ++i) { // a Fibonacci lattice
            const float z = 1 - (2 * float(i) + 1) / kCount, angle = 2.3999632f * float(i);
            const float r = std::sqrt(1 - z * z);
            add(sums, V3f(r * std::cos(angle), r * std::sin(angle), z));
        }
        for (const auto& [id, cell] : sums)
            cells.push_back(cell);
        sort();
    }
    /// Returns the cell whose normal is the nearest to a direction.
    static uint32_t cellAt(const CellPyramid& pyramid, const V3f& direction) {
        uint32_t best = 0;
        for (uint32_t i = 0; i < pyramid.cellCount(); ++i)
            if (dot(nodeOf(pyramid, i).n, direction) > dot(nodeOf(pyramid, best).n, direction))
                best = i;
        return best;
    }
    static const CellNode& nodeOf(const CellPyramid& pyramid, uint32_t cell) {
        return pyramid.nodes()[pyramid.nodeOf(cell)];
    }

  private:
    static void add(std::map<std::tuple<int, int, int, int>, CellSums>& cells, const V3f& n) {
        int corner[3], axis = 0;
        for (int k = 0; k < 3; ++k) {
            corner[k] = int(std::floor(kRadius * n[k]));
            if (std::abs(n[k]) > std::abs(n[axis]))
                axis = k;
        }
        const int face = 2 * axis + (n[axis] < 0);
        CellSums& sums = cells[{corner[0], corner[1], corner[2], face}];
        sums.id = {7, corner[0], corner[1], corner[2], 0, uint16_t(face)};
        for (int k = 0; k < 3; ++k) {
            sums.p[k] += int64_t((kRadius * n[k] - float(corner[k])) * (1 << CellSums::kPositionBits));
            sums.n[k] += int64_t(n[k] * (1 << CellSums::kNormalBits));
        }
        ++sums.count[(sums.count[0] + sums.count[1]) % kHalves];
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

/// A single sample lights all of its surroundings, wherever these are on the sphere, without an edge.
TEST(RareLight, HasNoEdgesOnASphere) {
    for (const V3f& direction : {V3f(1, 0, 0), V3f(0.8f, 0.6f, 0), V3f(-0.577f, 0.577f, 0.577f)}) {
        Sphere sphere;
        sphere.addOtherLight(1);
        const CellPyramid pyramid = sphere.pyramid();
        const uint32_t lit = Sphere::cellAt(pyramid, direction);
        sphere.addSample(lit, 1e5f);
        const RareLight rare(pyramid, pyramid.cellsByNode(), sphere.samples, kPart, kSamples);
        float most = 0;
        for (uint32_t cell = 0; cell < pyramid.cellCount(); ++cell)
            most = std::max(most, rare.light(cell).x);
        EXPECT_GT(rare.light(lit).x, 0.5f * most);
        for (uint32_t a = 0; a < pyramid.cellCount(); ++a) {
            const CellNode& node = Sphere::nodeOf(pyramid, a);
            if (dot(node.n, direction) > 0.8f) {
                EXPECT_GT(rare.light(a).x, 0);
            }
            for (uint32_t b = a + 1; b < pyramid.cellCount(); ++b)
                if (length(Sphere::nodeOf(pyramid, b).p - node.p) < 2) {
                    EXPECT_NEAR(rare.light(a).x, rare.light(b).x, 0.25f * most) << node.n;
                }
        }
    }
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

/// A single sample that would make its surface many times as bright stays in its pixel.
TEST(RareLight, OneSampleDoesNotMakeASurfaceWhite) {
    constexpr float kOther = 0.01f;
    const auto at = [&](float light) {
        Plane plane;
        plane.addOtherLight(kOther);
        plane.addSample(32, 32, light);
        const CellPyramid pyramid = plane.pyramid();
        const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
        const uint32_t cell = plane.cellAt(32, 32);
        return std::pair(rare.spread(cell), rare.light(cell).x);
    };
    const float count = kSize * kSize * kSamples;
    const auto [credible, credibleLight] = at(2 * kOther * count);
    EXPECT_EQ(credible, 1);
    EXPECT_GT(credibleLight, kOther);
    const auto [incredible, incredibleLight] = at(1e4f * kOther * count);
    EXPECT_LT(incredible, 1e-5f);
    EXPECT_LT(incredibleLight, 0.1f * kOther);
}

/// Samples that support each other are spread, however bright they are.
TEST(RareLight, SeveralSamplesAreCredible) {
    Plane plane;
    plane.addOtherLight(1e-3f);
    for (int y = 4; y < kSize; y += 8)
        for (int x = 4; x < kSize; x += 8)
            plane.addSample(x, y, 64 * kSamples);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    for (const PixelRareSample& sample : plane.samples)
        EXPECT_GT(rare.spread(sample.cell), 0.9f);
}

/// One bright sample does not light a whole small surface: it has the mean of the surfaces with few samples.
/// Those with less light keep theirs.
TEST(RareLight, SmallSurfacesHaveAtMostTheirMean) {
    constexpr int kLit = 8;
    Squares squares(kLit + 1);
    squares.addSample(squares.firstCell(0), 1e5f);
    for (int surface = 1; surface < kLit; ++surface)
        squares.addSample(squares.firstCell(surface), 10);
    const CellPyramid pyramid = squares.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), squares.samples, kPart, kSamples);
    const float mean = (1e5f + (kLit - 1) * 10) / (kLit * Squares::kCells * kSamples);
    EXPECT_NEAR(rare.light(squares.firstCell(0)).x, mean, 0.5f * mean);
    for (int surface = 1; surface < kLit; ++surface) {
        const float light = rare.light(squares.firstCell(surface)).x;
        EXPECT_GT(light, 0) << surface;
        EXPECT_LT(light, 0.01f * mean) << surface;
    }
    EXPECT_EQ(rare.light(squares.firstCell(kLit)), Rgb(0));
}

/// Two surfaces may differ as much as their samples do.
TEST(RareLight, TwoSurfacesDoNotShareIt) {
    Squares squares(2);
    squares.addOtherLight(100);
    squares.addSample(squares.firstCell(0), 1e5f);
    squares.addSample(squares.firstCell(1), 1e3f);
    const CellPyramid pyramid = squares.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), squares.samples, kPart, kSamples);
    EXPECT_NEAR(rare.light(squares.firstCell(0)).x / rare.light(squares.firstCell(1)).x, 100, 1);
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

/// A highlight narrower than the smallest region: a pixel has two thirds of a sample there, a fourth in the
/// region.
TEST(RareLight, NarrowHighlightsAreHardlyRare) {
    Plane plane;
    for (int i = 0; i < 6; ++i)
        plane.addSample(32, 32, 10);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples / 4);
    EXPECT_LT(rare.rarity(plane.cellAt(32, 32)), 0.1f);
}

/// Adds samples to every other cell of a square around the middle.
void addCluster(Plane& plane, float light) {
    for (int y = 30; y < 35; ++y)
        for (int x = 30; x < 35; ++x)
            if ((x + y) % 2 == 0)
                plane.addSample(x, y, light);
}

/// Chance does not bring so many samples together: they do not light cells around them that have none.
TEST(RareLight, ClustersKeepTheirLight) {
    Plane plane;
    addCluster(plane, 10);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    EXPECT_GT(rare.rarity(plane.cellAt(32, 32)), 0);
    EXPECT_GT(rare.light(plane.cellAt(32, 32)).x, 0);
    for (const int i : {4, 12, 20, 44, 52, 60})
        EXPECT_EQ(rare.light(plane.cellAt(i, 32)).x, 0) << i;
}

/// Nor do they hide the rare light of these.
TEST(RareLight, ClustersLeaveOtherLight) {
    Plane plane;
    for (int y = 4; y < kSize; y += 8)
        for (int x = 4; x < kSize; x += 8)
            plane.addSample(x, y, 64 * kSamples);
    addCluster(plane, 64 * kSamples);
    const CellPyramid pyramid = plane.pyramid();
    const RareLight rare(pyramid, pyramid.cellsByNode(), plane.samples, kPart, kSamples);
    for (int y = 12; y < 52; ++y)
        for (const int x : {12, 16, 48, 52})
            EXPECT_NEAR(rare.light(plane.cellAt(x, y)).x, 1, 0.3f) << x << " " << y;
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
