// Which small triangles lie in the cells of a grid.
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

using namespace test;

TEST(LatticeGrid, SmallTrianglesAreInGridsWhereTheseGain) {
    // However an instance is turned and scaled: those left out unasked must be those that gain nothing.
    const BuiltScene built = test::build(
        kView + ("ObjectBegin \"o\"\n" + subdivided(4) + "ObjectEnd\nAttributeBegin\nTranslate -1 0 0\n" +
                 "Rotate 30 1 1 0\nScale 1.5 .4 .8\nObjectInstance \"o\"\nAttributeEnd\n" +
                 "Translate 1 1 0\nRotate 50 0 1 1\nScale .9 .9 .9\nObjectInstance \"o\"\n"));
    const Scene& scene = *built.scene;
    const TriangleMesh& mesh = *scene.geometry({0, 0}).placed.shape.mesh;
    const MeshCells cells(mesh, {});
    const auto hits = randomHits(scene, 20000);
    int vertices = 0, grids = 0;
    for (float blockSize = .5f; blockSize < 8; blockSize *= 1.2f) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        SurfaceCache surfaces = lattice.surfaceCache();
        for (const VisibilitySample& s : hits) {
            LatticeSoA lanes;
            lanes.add(s.hit, s.ray.d, s.ray.time, scene.camera().cone(s.film));
            lattice.locate(lanes, surfaces);
            if (lanes.kind[0] != LatticeCell::Vertices && lanes.kind[0] != LatticeCell::Grid)
                continue;
            MeshCell lowest;
            V3f place;
            const float cellArea = 2 * sqr(lanes.block[0]) / std::sqrt(lanes.normal2[0]);
            const bool gains = cells.surround(s.hit.prim, s.hit.u, s.hit.v, cellArea, lowest, place);
            ASSERT_EQ(gains, lanes.kind[0] == LatticeCell::Grid);
            ++(gains ? grids : vertices);
        }
    }
    EXPECT_GT(vertices, 500);
    EXPECT_GT(grids, 1000);
}

} // namespace
} // namespace strobe
