// The lattice of shading points: how far its points are, what it interpolates exactly, and its keys.
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

#include <map>
#include <unordered_map>

namespace strobe {
namespace {

using namespace test;

V3f placeOf(const Scene& scene, const LatticeFace& face, const LatticePoint& p, float time) {
    return scene.surface({face.instance, face.geometry, p.prim, p.u, p.v, 0}, time).p;
}

struct Reach {
    double most = 0; ///< in blocks
    size_t hits = 0, beyond = 0;
};

/// How many blocks away the points around `samples` are, as their rays see them; and that weights are
/// weights.
Reach reachOf(const Scene& scene, float blockSize, const std::vector<VisibilitySample>& samples,
              double bound) {
    const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
    Reach reach;
    for (const VisibilitySample& s : samples) {
        const Located cell = locate(scene, lattice, s);
        const auto points = pointsAround(lattice, cell);
        const RayCone cone = scene.camera().cone(s.film);
        const double block = double(blockSize) * double(cone.width + s.hit.t * cone.spread);
        const V3f at = scene.surface(s.hit, s.ray.time).p;
        double sum = 0, most = 0;
        bool any = false;
        for (int k = 0; k < cell.count(); ++k) {
            EXPECT_GE(cell.weights[k], 0);
            sum += double(cell.weights[k]);
            if (!points[k])
                continue;
            any = true;
            const V3f away = placeOf(scene, cell.face, points[k], s.ray.time) - at;
            most = std::max(most, double(length(away - s.ray.d * dot(away, s.ray.d))) / block);
        }
        EXPECT_TRUE(any);
        EXPECT_NEAR(sum, 1, 2e-6);
        ++reach.hits;
        reach.beyond += most > bound;
        reach.most = std::max(reach.most, most);
    }
    return reach;
}

struct ReachCase {
    const char* name;
    std::string world;
    double bound = SurfaceLattice::kReach;
};

/// Nothing bends in a triangle: two sides of two blocks.
constexpr double kFlat = 4;
/// Of the eight cells around a hit the farthest corner is 3/2 cells away along each axis; a level's cells are
/// up to 2^(1/4) times as long as was asked for. Stretched by 2, 1 and 0.3, a triangle may have been
/// shortened by the root of 0.3 and the way to its neighbors doubled.
const double kStretched = 1.5 * std::sqrt(3) * std::pow(2, .25) * 2 / std::sqrt(.3);

class LatticeReach : public testing::TestWithParam<ReachCase> {};

TEST_P(LatticeReach, IsAsDocumented) {
    const BuiltScene built = test::build(kView + GetParam().world);
    const auto hits = randomHits(*built.scene, 60000);
    ASSERT_GT(hits.size(), 1000u);
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const Reach reach = reachOf(*built.scene, blockSize, hits, GetParam().bound);
        EXPECT_LE(reach.most, GetParam().bound)
            << "blocksize " << blockSize << ", " << reach.beyond << " of " << reach.hits;
    }
}

const std::string kTurning =
    "ActiveTransform EndTime\nTranslate .4 0 .2\nRotate 70 1 2 3\nActiveTransform All\n";

std::string instanced(const std::string& shape) {
    return "ObjectBegin \"o\"\n" + shape + "ObjectEnd\nAttributeBegin\nTranslate -1 0 0\nRotate 30 1 1 0\n" +
           "Scale .7 .7 .7\nObjectInstance \"o\"\nAttributeEnd\nTranslate 1 1 0\n" + kTurning +
           "ObjectInstance \"o\"\n";
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, LatticeReach,
    testing::Values(ReachCase{"LargeTriangles", randomTriangles(60, 1.5f), kFlat},
                    ReachCase{"LargeWithNormals", randomTriangles(60, 1.5f, true), kFlat},
                    ReachCase{"SmallTriangles", randomTriangles(3000, .1f), kFlat},
                    ReachCase{"Floor",
                              "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" "
                              "[-9 -9 -1 9 -9 -1 9 900 -1 -9 900 -1]\n",
                              kFlat},
                    ReachCase{"Sphere", "Rotate 40 1 0 0\nShape \"sphere\" \"float radius\" 1.8\n"},
                    ReachCase{"SphereFromSide", "Shape \"sphere\" \"float radius\" 1.8\n"},
                    ReachCase{"Disk",
                              "Translate 0 0 -.5\nRotate 5 1 0 0\nShape \"disk\" \"float radius\" 2\n"},
                    ReachCase{"FineMesh", subdivided(8), kFlat},
                    ReachCase{"Instances", instanced(subdivided(7)), kFlat},
                    ReachCase{"InstancesOfQuadrics", instanced("Shape \"sphere\"\n")},
                    ReachCase{"MovingCoarse", kTurning + subdivided(2), kFlat},
                    ReachCase{"MovingFine", kTurning + subdivided(7), kFlat},
                    ReachCase{"StretchedFine", kTurning + "Scale 2 1 .3\n" + subdivided(7), kStretched}),
    [](const auto& info) { return info.param.name; });

/// The hit that the camera's ray to (u, v) of a triangle would have, were nothing in its way.
VisibilitySample sampleAt(const Scene& scene, uint32_t prim, float u, float v) {
    VisibilitySample s{};
    s.hit = {kNone, 0, prim, u, v, 0};
    s.film = V2f(100);
    const V3f eye = scene.camera().position(0), to = scene.surface(s.hit, 0).p - eye;
    s.hit.t = length(to);
    s.ray = {eye, normalize(to), 0, 0};
    return s;
}

bool isWhole(const LatticeCell& cell) {
    if (cell.kind == LatticeCell::Vertices)
        return true;
    const float more = cell.kind == LatticeCell::Upper ? 1 : 0;
    const float u = cell.i / cell.nu, v = cell.j / cell.nv;
    return std::max({u + 1 / cell.nu + v + more / cell.nv, u + v + 1 / cell.nv}) <= 1;
}

TEST(Lattice, ReproducesWhatIsLinearOverATriangle) {
    // Place itself is linear: mixing the points must give the hit. Cells that a triangle's third edge cuts
    // are excepted where its sides are divided differently, and no others.
    const BuiltScene built =
        test::build(kView + randomTriangles(60, 1.5f) + randomTriangles(3000, .1f, true));
    const Scene& scene = *built.scene;
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        size_t whole = 0, vertices = 0;
        for (const VisibilitySample& s : randomHits(scene, 40000)) {
            const Located cell = locate(scene, lattice, s);
            if (cell.kind == LatticeCell::Grid || (!isWhole(cell) && cell.nu != cell.nv))
                continue;
            const auto points = pointsAround(lattice, cell);
            V3f mixed(0);
            for (int k = 0; k < cell.count(); ++k)
                mixed += placeOf(scene, cell.face, points[k], 0) * cell.weights[k];
            ASSERT_LT(length(mixed - scene.surface(s.hit, 0).p), 3e-6f) << blockSize;
            ++whole, vertices += cell.kind == LatticeCell::Vertices;
        }
        EXPECT_GT(whole, 5000u);
        EXPECT_TRUE(blockSize < 4 || vertices > 0);
    }
}

/// What the lattice makes of a function of place that is nowhere linear and nowhere steeper than 1.
double mixtureAt(const Scene& scene, const SurfaceLattice& lattice, const VisibilitySample& s,
                 std::map<uint64_t, float>* weights = nullptr) {
    const Located cell = locate(scene, lattice, s);
    const auto points = pointsAround(lattice, cell);
    double sum = 0;
    for (int k = 0; k < cell.count(); ++k) {
        if (!points[k])
            continue;
        const V3f p = placeOf(scene, cell.face, points[k], 0);
        sum += double(cell.weights[k]) * std::sin(20 * (p.x + 2 * p.z)) / (20 * std::sqrt(5.));
        if (weights && cell.weights[k] > 1e-6f)
            (*weights)[SurfaceLattice::keyOf(points[k], 0)] += cell.weights[k];
    }
    return sum;
}

std::string facingQuad(float size) {
    const std::string s = std::to_string(size);
    return "Scale " + s + " 1 " + s +
           "\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"normal N\" [0 -1 0 0 -1 0 0 -1 0 0 "
           "-1 "
           "0] \"point P\" [0 0 0 1.6 0 .1 1.7 0 1.1 .1 0 1]\n";
}

/// An edge and the two triangles that share it.
struct SharedEdge {
    uint32_t from, to, prim[2];
};

std::vector<SharedEdge> sharedEdges(const TriangleMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> first;
    std::vector<SharedEdge> edges;
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = mesh.indices[3 * prim + k], b = mesh.indices[3 * prim + (k + 1) % 3];
            const auto [at, isNew] = first.try_emplace(std::minmax(a, b), prim);
            if (!isNew)
                edges.push_back({a, b, {at->second, prim}});
        }
    return edges;
}

/// Seen from a triangle that has the edge, `along` of the way down the edge.
VisibilitySample sampleOn(const Scene& scene, const TriangleMesh& mesh, uint32_t prim, const SharedEdge& edge,
                          float along) {
    float w[3];
    for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t vertex = mesh.indices[3 * prim + k];
        w[k] = vertex == edge.from ? 1 - along : vertex == edge.to ? along : 0;
    }
    return sampleAt(scene, prim, w[1], w[2]);
}

TEST(Lattice, IsContinuousAcrossASharedEdge) {
    // Two triangles that are divided, and two smaller than a cell; then a ball of triangles about as large as
    // a block.
    const std::string worlds[] = {facingQuad(1), facingQuad(.01f), "Scale 1.8 1.8 1.8\n" + subdivided(5)};
    size_t compared[5] = {};
    for (const std::string& world : worlds) {
        const BuiltScene built = test::build(kView + world);
        const Scene& scene = *built.scene;
        const TriangleMesh& mesh = *scene.groups()[0].geometries[0].placed.shape.mesh;
        for (const float blockSize : {1.f, 2.5f, 4.f, 5.f}) {
            const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
            for (const SharedEdge& edge : sharedEdges(mesh))
                for (uint64_t i = 0; i < (&world == worlds + 2 ? 2 : 500); ++i) {
                    const float along = random(i, edge.from);
                    const VisibilitySample a = sampleOn(scene, mesh, edge.prim[0], edge, along),
                                           b = sampleOn(scene, mesh, edge.prim[1], edge, along);
                    const Located one = locate(scene, lattice, a), other = locate(scene, lattice, b);
                    const bool small = one.kind == LatticeCell::Vertices || one.kind == LatticeCell::Grid;
                    if (&world == worlds + 2 &&
                        (one.kind != LatticeCell::Vertices || other.kind != one.kind ||
                         one.face.positive != other.face.positive))
                        continue; // cells of curved surfaces may differ in level or direction
                    std::map<uint64_t, float> ofOne, ofOther;
                    ASSERT_NEAR(mixtureAt(scene, lattice, a, &ofOne), mixtureAt(scene, lattice, b, &ofOther),
                                3e-6);
                    ++compared[one.kind];
                    if (!small) // these share places, not shades
                        continue;
                    for (const auto& [key, weight] : ofOne)
                        ASSERT_NEAR(weight, ofOther[key], 3e-6f);
                }
        }
    }
    for (const int kind : {LatticeCell::Vertices, LatticeCell::Grid, LatticeCell::Lower})
        EXPECT_GT(compared[kind], 500u) << kind;
}

TEST(Lattice, IsContinuousInsideATriangleOfOneDivision) {
    const BuiltScene built = test::build(kView + randomTriangles(60, 1.5f));
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, 1, SurfaceLattice::SmallTriangles::Shared);
    constexpr float kStep = 1e-4f;
    size_t compared = 0, crossed = 0;
    for (uint64_t i = 0; i < 200000; ++i) {
        const float u = random(i, 0), v = random(i, 1) * (1 - u), step = std::min(kStep, 1 - u - v);
        const uint32_t prim = uint32_t(i % 60);
        const VisibilitySample a = sampleAt(scene, prim, u, v);
        const VisibilitySample b = sampleAt(scene, prim, u + (i & 64 ? step : 0), v + (i & 64 ? 0 : step));
        const Located one = locate(scene, lattice, a), other = locate(scene, lattice, b);
        if (one.nu != other.nu || one.nv != other.nv || one.kind == LatticeCell::Grid)
            continue;
        // A cell that the third edge cuts may be squeezed to nothing on one side: it is no steeper than the
        // triangle's longest edge over a step.
        EXPECT_NEAR(mixtureAt(scene, lattice, a), mixtureAt(scene, lattice, b), 8 * double(kStep)) << i;
        ++compared, crossed += one.key != other.key;
    }
    EXPECT_GT(compared, 100000u);
    EXPECT_GT(crossed, 300u);
}

TEST(Lattice, KeysTellPointsApart) {
    // Every point of a fine division of every triangle, and of a coarser one, whose points are among them.
    const std::string world = "ObjectBegin \"o\"\n" + subdivided(1) +
                              "ObjectEnd\nObjectInstance \"o\"\nTranslate 1 "
                              "0 0\nObjectInstance \"o\"\n";
    const BuiltScene built = test::build(kView + world);
    const SurfaceLattice lattice(*built.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    std::unordered_map<uint64_t, uint64_t> placeOfKey, keyOfPlace;
    const auto add = [&](const LatticeCell& cell, uint32_t bin) {
        const auto points = pointsAround(lattice, cell);
        for (int k = 0; k < cell.count(); ++k) {
            const LatticePoint& p = points[k];
            uint64_t place = p.prim;
            for (const uint64_t item : {uint64_t(cell.face.instance), uint64_t(cell.face.positive),
                                        uint64_t(bin), uint64_t(p.u * 64), uint64_t(p.v * 64)})
                place = place << 8 | item;
            const uint64_t key = SurfaceLattice::keyOf(p, bin);
            ASSERT_EQ(placeOfKey.try_emplace(key, place).first->second, place);
            ASSERT_EQ(keyOfPlace.try_emplace(place, key).first->second, key);
        }
    };
    LatticeCell cell{};
    cell.kind = LatticeCell::Lower;
    for (const int n : {64, 16})
        for (uint32_t item = 0; item < 2 * 2 * 4 * 32; ++item) {
            cell.face = {item & 1, 0, bool(item & 2)};
            cell.prim = item >> 4;
            cell.nu = cell.nv = float(n);
            for (int i = 0; i < n; ++i)
                for (int j = 0; i + j < n; ++j) {
                    cell.i = float(i), cell.j = float(j);
                    add(cell, item >> 2 & 3);
                }
        }
    EXPECT_GT(placeOfKey.size(), 1000000u);
}

TEST(Lattice, DividesWhatOnlyTranslatesLikeWhatRests) {
    const std::string world = "Rotate 30 1 2 3\nScale 1 1.5 .8\n" + randomTriangles(40, 1.5f);
    const BuiltScene still = test::build(kView + world);
    const BuiltScene moving = test::build(
        std::string(kView) + "ActiveTransform EndTime\nTranslate .7 0 .4\nActiveTransform All\n" + world);
    ASSERT_TRUE(moving.scene->instances().at(0).motion->onlyTranslates());
    const SurfaceLattice ofStill(*still.scene, 1, SurfaceLattice::SmallTriangles::Shared),
        ofMoving(*moving.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    const auto hits = randomHits(*moving.scene, 20000);
    ASSERT_GT(hits.size(), 1000u);
    size_t differing = 0;
    for (VisibilitySample s : hits) {
        const Located cell = locate(*moving.scene, ofMoving, s);
        s.hit.instance = kNone;
        const Located other = locate(*still.scene, ofStill, s);
        differing += cell.kind != other.kind || cell.nu != other.nu || cell.nv != other.nv;
    }
    EXPECT_LE(differing, hits.size() / 1000); // rounding
}

TEST(Lattice, CellsOfOneKeyHaveTheSamePoints) {
    const BuiltScene built = test::build(kView + randomTriangles(40, 1.5f) + instanced(subdivided(6)) +
                                         "Shape \"sphere\" \"float radius\" .5\n");
    const auto hits = randomHits(*built.scene, 200000);
    for (const float blockSize : {1.f, 4.f}) {
        const SurfaceLattice lattice(*built.scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        std::unordered_map<uint64_t, std::vector<uint64_t>> pointsOf;
        size_t again = 0;
        for (const VisibilitySample& s : hits) {
            const Located cell = locate(*built.scene, lattice, s);
            const auto points = pointsAround(lattice, cell);
            std::vector<uint64_t> keys;
            for (int k = 0; k < cell.count(); ++k)
                keys.push_back(points[k] ? SurfaceLattice::keyOf(points[k], 0) : 0);
            const auto [at, isNew] = pointsOf.try_emplace(cell.key, keys);
            ASSERT_EQ(at->second, keys);
            again += !isNew;
        }
        EXPECT_GT(again, 10000u);
        EXPECT_GT(pointsOf.size(), 1000u);
    }
}

TEST(Lattice, HitsSideBySideAreEachFoundAsIfAlone) {
    const BuiltScene built = test::build(kView + randomTriangles(40, 1.5f) + instanced(subdivided(6)) +
                                         kTurning + subdivided(4) + "Shape \"sphere\" \"float radius\" .5\n");
    const Scene& scene = *built.scene;
    const auto hits = randomHits(scene, 40000);
    int ofKind[5] = {};
    for (const float blockSize : {.25f, 2.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        for (size_t first = 0; first < hits.size(); first += kSoAWidth) {
            LatticeSoA lanes;
            for (size_t i = first; i < std::min(first + kSoAWidth - first % 7, hits.size()); ++i)
                lanes.add(hits[i].hit, hits[i].ray.d, hits[i].ray.time, scene.camera().cone(hits[i].film));
            SurfaceCache surfaces = lattice.surfaceCache();
            lattice.locate(lanes, surfaces);
            for (int i = 0; i < lanes.count; ++i) {
                const Located alone = locate(scene, lattice, hits[first + size_t(i)]);
                ASSERT_EQ(lanes.key[i], alone.key);
                ASSERT_EQ(lanes.kind[i], alone.kind);
                float weights[LatticeCell::kPoints]{};
                LatticeCell::weigh(alone.kind, lanes.place.at(i), weights);
                for (int k = 0; k < LatticeCell::kPoints; ++k)
                    ASSERT_EQ(weights[k], alone.weights[k]);
                ++ofKind[alone.kind];
            }
        }
    }
    for (const int count : ofKind)
        EXPECT_GT(count, 20);
}

} // namespace
} // namespace strobe
