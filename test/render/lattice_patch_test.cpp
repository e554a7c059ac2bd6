// Hits of one triangle, located together.
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using namespace test;

constexpr uint32_t kBins = 4;

/// Hits of one primitive, as a block of samples has them.
struct Block {
    std::vector<VisibilitySample> hits;
    VisibilityLanes samples;
    LatticeLanes cones;
    uint32_t slot[kLanes];

    Block(const Scene& scene, const std::vector<VisibilitySample>& all) {
        for (const VisibilitySample& s : all) {
            if (s.hit.prim != all[0].hit.prim || s.hit.geometry != all[0].hit.geometry ||
                s.hit.instance != all[0].hit.instance)
                continue;
            const int i = int(hits.size());
            const RayCone cone = scene.camera().cone(s.film);
            samples.hit.set(i, s.hit), samples.ray.d.set(i, s.ray.d);
            cones.width[i] = cone.width, cones.spread[i] = cone.spread;
            slot[i] = uint32_t(s.ray.time * kBins);
            hits.push_back(s);
        }
    }
};

const LatticePatch::Cell* listedOf(const LatticePatch& patch, int hit) {
    for (int k = 0; k < patch.cells; ++k)
        if (patch.listed[k].cell == patch.cell[hit])
            return &patch.listed[k];
    return nullptr;
}

/// Cell, points and weights of each hit must be those that it has by itself.
void expectAsIfAlone(const Scene& scene, const SurfaceLattice& lattice, const Block& block,
                     LatticePatch& patch, const V3Lanes& place) {
    patch.list(block.slot);
    lattice.points(block.samples.hit, patch.nodes, 1);
    std::vector<uint32_t> asked(size_t(patch.nodes.count));
    for (int i = 0; i < int(block.hits.size()); ++i) {
        const Located alone = locate(scene, lattice, block.hits[size_t(i)]);
        const auto points = pointsAround(lattice, alone);
        ASSERT_EQ(alone.count(), 3);
        ASSERT_EQ(alone.face.positive, bool(patch.nodes.positive[0]));
        float weights[LatticeCell::kPoints];
        LatticeCell::weigh(LatticeCell::Lower, place.at(i), weights);
        const LatticePatch::Cell* cell = listedOf(patch, i);
        ASSERT_TRUE(cell);
        for (int k = 0; k < 3; ++k) {
            const LatticePoint p = lattice.placeOf(alone.face, patch.nodes.points[0].at(cell->node[k]));
            ASSERT_EQ(p.keySum, points[k].keySum);
            ASSERT_EQ(p.prim, points[k].prim);
            ASSERT_EQ(V2f(p.u, p.v), V2f(points[k].u, points[k].v));
            ASSERT_EQ(weights[k], alone.weights[k]);
            asked[cell->node[k]] |= 1u << block.slot[i];
        }
    }
    for (int node = 0; node < patch.nodes.count; ++node) {
        ASSERT_EQ(patch.slots[node], asked[size_t(node)]); // no more, no less
        const LatticePatch::Cell* cell = listedOf(patch, patch.hit[node]);
        ASSERT_TRUE(std::find(cell->node, cell->node + 3, node) != cell->node + 3);
    }
}

TEST(LatticePatch, FindsEachHitAsIfAlone) {
    const std::string moved = "ActiveTransform EndTime\nTranslate .7 0 .4\nActiveTransform All\n";
    const BuiltScene built =
        test::build(kView + randomTriangles(40, 1.5f) + randomTriangles(30, .6f, true) + moved +
                    "Scale 1 1.2 .7\n" + randomTriangles(30, 1.5f, true) + subdivided(3));
    const Scene& scene = *built.scene;
    int patches = 0, others = 0, large = 0;
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        SurfaceParts parts = lattice.parts();
        for (uint64_t window = 0; window < 3000; ++window) {
            const V2f from = V2f(random(window, 40), random(window, 41)) * 195.f;
            const auto hits = randomHits(scene, int(1 + window % kLanes), from, 4 * random(window, 42));
            if (hits.empty())
                continue;
            const Block block(scene, hits);
            LatticePatch patch;
            V3Lanes place;
            const int n = int(block.hits.size());
            if (lattice.findPatch(block.samples, n, block.cones, parts, patch, place)) {
                expectAsIfAlone(scene, lattice, block, patch, place);
                ++patches, large += patch.cells > 5;
            } else {
                ++others;
            }
        }
    }
    EXPECT_GT(patches, 1000);
    EXPECT_GT(large, 300);
    EXPECT_GT(others, 300);
}

} // namespace
} // namespace strobe
