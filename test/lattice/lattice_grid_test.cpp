// Small triangles that use mesh cells.
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using namespace test;

const std::string kScaledInstances = R"(ObjectBegin "o"
)" + subdivided(4) + R"(ObjectEnd
AttributeBegin
  Translate -1 0 0
  Rotate 30 1 1 0
  Scale 1.5 .4 .8
  ObjectInstance "o"
AttributeEnd
Translate 1 1 0
Rotate 50 0 1 1
Scale .9 .9 .9
ObjectInstance "o"
)";

TEST(LatticeGrid, MeshCellsAreUsedWhereverTheyAreUsable) {
    // SurfaceLattice skips the query for blocks below LatticeSurface::minBlockArea. It must skip only queries
    // that would return false, however an instance is rotated and scaled.
    const BuiltScene built = test::build(kView + kScaledInstances);
    const Scene& scene = *built.scene;
    const TriangleMesh& mesh = *scene.geometry({0, 0}).placed.shape.mesh;
    const MeshCells cells(mesh, {});
    const auto samples = randomHits(scene, 20000);
    int vertices = 0, grids = 0;
    for (float blockSize = .5f; blockSize < 8; blockSize *= 1.2f) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        SurfaceCache surfaces = lattice.makeSurfaceCache();
        for (const VisibilitySample& s : samples) {
            LatticeHitSoA hits;
            push_back(hits, scene, s);
            lattice.locate(hits, surfaces);
            if (hits.kind[0] != LatticeCell::Vertices && hits.kind[0] != LatticeCell::Grid)
                continue;
            MeshCell lowest;
            V3f coords;
            const float cellArea = 2 * sqr(hits.blockSize[0]) / std::sqrt(hits.normal2[0]);
            const bool isUsable = cells.surround(s.hit.prim, s.hit.u, s.hit.v, cellArea, lowest, coords);
            ASSERT_EQ(isUsable, hits.kind[0] == LatticeCell::Grid);
            ++(isUsable ? grids : vertices);
        }
    }
    EXPECT_GT(vertices, 500);
    EXPECT_GT(grids, 1000);
}

} // namespace
} // namespace strobe
