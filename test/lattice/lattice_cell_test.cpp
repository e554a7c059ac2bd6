#include "lattice/lattice_cell.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace strobe {
namespace {

TEST(LatticeCell, NearestPointHasTheGreatestWeight) {
    using Cell = LatticeCell;
    constexpr int kSteps = 23; // odd: no position is equally near to two points of a grid
    int nearestCount[Cell::kMaxPoints] = {};
    for (const Cell::Kind kind : {Cell::Vertices, Cell::Lower, Cell::Upper, Cell::Rectangle, Cell::Grid}) {
        const int pointCount = Cell::pointCountOf(kind);
        for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
            const auto coord = [](int k) { return (float(k % kSteps) + .4f) / float(kSteps); };
            V3f coords(coord(i), coord(i / kSteps), coord(i / kSteps / kSteps));
            const bool isTriangle = pointCount == 3;
            if (isTriangle && coords.x + coords.y > 1)
                continue;
            if (isTriangle)
                coords.z = firstWeight(coords.x, coords.y);
            float weights[Cell::kMaxPoints];
            Cell::computeWeights(kind, coords, weights);
            const int nearest = Cell::nearestPoint(kind, coords);
            ASSERT_LT(nearest, pointCount);
            ASSERT_GE(weights[nearest], *std::max_element(weights, weights + pointCount) - 1e-6f)
                << kind << ' ' << coords;
            ++nearestCount[nearest];
        }
    }
    EXPECT_GT(*std::min_element(nearestCount, nearestCount + Cell::kMaxPoints), 500);
}

} // namespace
} // namespace strobe
