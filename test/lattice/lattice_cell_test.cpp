#include "lattice/lattice_soa.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace strobe {
namespace {

TEST(LatticeCell, TheNearestPointHasTheGreatestWeight) {
    using Cell = LatticeCell;
    constexpr int kSteps = 23; // odd: no place is as near to two points of a grid
    int seen[Cell::kPoints] = {};
    for (const Cell::Kind kind : {Cell::Vertices, Cell::Lower, Cell::Upper, Cell::Rectangle, Cell::Grid})
        for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
            const auto at = [](int k) { return (float(k % kSteps) + .4f) / float(kSteps); };
            V3f place(at(i), at(i / kSteps), at(i / kSteps / kSteps));
            const bool isTriangle = Cell::pointsOf(kind) == 3;
            if (isTriangle && place.x + place.y > 1)
                continue;
            if (isTriangle)
                place.z = firstWeight(place.x, place.y);
            float weights[Cell::kPoints];
            Cell::weigh(kind, place, weights);
            const int nearest = Cell::nearest(kind, place);
            ASSERT_LT(nearest, Cell::pointsOf(kind));
            ASSERT_GE(weights[nearest], *std::max_element(weights, weights + Cell::pointsOf(kind)) - 1e-6f)
                << kind << ' ' << place;
            ++seen[nearest];
        }
    EXPECT_GT(*std::min_element(seen, seen + Cell::kPoints), 500);
}

} // namespace
} // namespace strobe
