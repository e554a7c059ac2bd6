// SurfaceLattice: the distance of its points, exact and continuous interpolation, and its keys.
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

#include <map>
#include <unordered_map>

namespace strobe {
namespace {

using namespace test;

V3f positionOf(const Scene& scene, const SurfaceSide& side, const LatticePoint& p, float time) {
    return scene.surface({side.instance, side.geometry, p.prim, p.u, p.v, 0}, time).p;
}

struct Reach {
    double max = 0; ///< in blocks
    size_t samples = 0, samplesBeyondBound = 0;
};

/// Returns how far the points of the samples' cells are, in blocks, as seen by their rays. Checks that
/// weights are not negative and sum to 1.
Reach measureReach(const Scene& scene, float blockSize, const std::vector<VisibilitySample>& samples,
                   double bound) {
    const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
    Reach reach;
    for (const VisibilitySample& s : samples) {
        const WeightedCell cell = locate(scene, lattice, s);
        const auto points = pointsOf(lattice, cell);
        const RayCone cone = scene.camera().cone(s.film);
        const double block = double(blockSize) * double(cone.width + s.hit.t * cone.spread);
        const V3f p = scene.surface(s.hit, s.ray.time).p;
        double weightSum = 0, max = 0;
        bool anyPoint = false;
        for (int k = 0; k < cell.pointCount(); ++k) {
            EXPECT_GE(cell.weights[k], 0);
            weightSum += double(cell.weights[k]);
            if (!points[k])
                continue;
            anyPoint = true;
            const V3f offset = positionOf(scene, cell.side, points[k], s.ray.time) - p;
            max = std::max(max, double(length(offset - s.ray.d * dot(offset, s.ray.d))) / block);
        }
        EXPECT_TRUE(anyPoint);
        EXPECT_NEAR(weightSum, 1, 2e-6);
        ++reach.samples;
        reach.samplesBeyondBound += max > bound;
        reach.max = std::max(reach.max, max);
    }
    return reach;
}

struct ReachCase {
    const char* name;
    std::string world;
    double bound = SurfaceLattice::kReach;
};

/// On triangles: two sides of two blocks.
constexpr double kFlatReach = 4;
/// The farthest corner of the eight cells around a hit is 3/2 cells away along each axis; the cells of a
/// level are up to 2^(1/4) times as long as requested. If stretched by 2, 1 and 0.3, a triangle may be
/// shorter by the square root of 0.3, and the distance to its neighbors doubled.
const double kStretchedReach = 1.5 * std::sqrt(3) * std::pow(2, .25) * 2 / std::sqrt(.3);

class LatticeReach : public testing::TestWithParam<ReachCase> {};

TEST_P(LatticeReach, IsWithinTheDocumentedBound) {
    const BuiltScene built = test::build(kView + GetParam().world);
    const auto samples = randomHits(*built.scene, 60000);
    ASSERT_GT(samples.size(), 1000u);
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const Reach reach = measureReach(*built.scene, blockSize, samples, GetParam().bound);
        EXPECT_LE(reach.max, GetParam().bound)
            << "blocksize " << blockSize << ", " << reach.samplesBeyondBound << " of " << reach.samples;
    }
}

const std::string kRotating = R"(
ActiveTransform EndTime
Translate .4 0 .2
Rotate 70 1 2 3
ActiveTransform All
)";

/// A static and a rotating instance.
std::string instanced(const std::string& shape) {
    return R"(ObjectBegin "o"
)" + shape +
           R"(
ObjectEnd
AttributeBegin
  Translate -1 0 0
  Rotate 30 1 1 0
  Scale .7 .7 .7
  ObjectInstance "o"
AttributeEnd
Translate 1 1 0
)" + kRotating +
           R"(ObjectInstance "o"
)";
}

const std::string kFloor = R"(
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 -9 -1  9 -9 -1  9 900 -1  -9 900 -1]
)";
const std::string kSphere = "Shape \"sphere\"\n", kLargeSphere = "Shape \"sphere\" \"float radius\" 1.8\n";
const std::string kSmallSphere = "Shape \"sphere\" \"float radius\" .5\n";
const std::string kTiltedDisk = R"(
Translate 0 0 -.5
Rotate 5 1 0 0
Shape "disk" "float radius" 2
)";

INSTANTIATE_TEST_SUITE_P(
    Scenes, LatticeReach,
    testing::Values(ReachCase{"LargeTriangles", randomTriangles(60, 1.5f), kFlatReach},
                    ReachCase{"LargeWithNormals", randomTriangles(60, 1.5f, true), kFlatReach},
                    ReachCase{"SmallTriangles", randomTriangles(3000, .1f), kFlatReach},
                    ReachCase{"Floor", kFloor, kFlatReach},
                    ReachCase{"Sphere", "Rotate 40 1 0 0\n" + kLargeSphere},
                    ReachCase{"SphereFromSide", kLargeSphere}, ReachCase{"Disk", kTiltedDisk},
                    ReachCase{"FineMesh", subdivided(8), kFlatReach},
                    ReachCase{"Instances", instanced(subdivided(7)), kFlatReach},
                    ReachCase{"InstancesOfQuadrics", instanced(kSphere)},
                    ReachCase{"MovingCoarse", kRotating + subdivided(2), kFlatReach},
                    ReachCase{"MovingFine", kRotating + subdivided(7), kFlatReach},
                    ReachCase{"StretchedFine", kRotating + "Scale 2 1 .3\n" + subdivided(7),
                              kStretchedReach}),
    [](const auto& info) { return info.param.name; });

/// Returns a camera ray to (u, v) of a triangle, whatever is in front of it.
VisibilitySample sampleAt(const Scene& scene, uint32_t prim, float u, float v) {
    VisibilitySample s{};
    s.hit = {kNone, 0, prim, u, v, 0};
    s.film = V2f(100);
    const V3f origin = scene.camera().position(0), toHit = scene.surface(s.hit, 0).p - origin;
    s.hit.t = length(toHit);
    s.ray = {origin, normalize(toHit), 0, 0};
    return s;
}

/// Whether the triangle's third edge does not cut the cell.
bool isInsideTriangle(const LatticeCell& cell) {
    if (cell.kind == LatticeCell::Vertices)
        return true;
    const float upper = cell.kind == LatticeCell::Upper ? 1 : 0;
    const float u = cell.i / cell.nu, v = cell.j / cell.nv;
    return std::max({u + 1 / cell.nu + v + upper / cell.nv, u + v + 1 / cell.nv}) <= 1;
}

TEST(Lattice, InterpolatesLinearFunctionsExactly) {
    // The position is linear over a triangle: the interpolated position must be the hit. Excepted are only
    // cells cut by the third edge of a triangle whose sides are divided differently.
    const BuiltScene built =
        test::build(kView + randomTriangles(60, 1.5f) + randomTriangles(3000, .1f, true));
    const Scene& scene = *built.scene;
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        size_t compared = 0, undivided = 0;
        for (const VisibilitySample& s : randomHits(scene, 40000)) {
            const WeightedCell cell = locate(scene, lattice, s);
            if (cell.kind == LatticeCell::Grid || (!isInsideTriangle(cell) && cell.nu != cell.nv))
                continue;
            const auto points = pointsOf(lattice, cell);
            V3f interpolated(0);
            for (int k = 0; k < cell.pointCount(); ++k)
                interpolated += positionOf(scene, cell.side, points[k], 0) * cell.weights[k];
            ASSERT_LT(length(interpolated - scene.surface(s.hit, 0).p), 3e-6f) << blockSize;
            ++compared;
            undivided += cell.kind == LatticeCell::Vertices;
        }
        EXPECT_GT(compared, 5000u);
        EXPECT_TRUE(blockSize < 4 || undivided > 0);
    }
}

/// Interpolates a function of position that is nowhere linear, with a gradient of at most 1. Adds the weights
/// of the points by key.
double interpolateWave(const Scene& scene, const SurfaceLattice& lattice, const VisibilitySample& s,
                       std::map<uint64_t, float>* weightOfKey = nullptr) {
    const WeightedCell cell = locate(scene, lattice, s);
    const auto points = pointsOf(lattice, cell);
    double sum = 0;
    for (int k = 0; k < cell.pointCount(); ++k) {
        if (!points[k])
            continue;
        const V3f p = positionOf(scene, cell.side, points[k], 0);
        sum += double(cell.weights[k]) * std::sin(20 * (p.x + 2 * p.z)) / (20 * std::sqrt(5.));
        if (weightOfKey && cell.weights[k] > 1e-6f)
            (*weightOfKey)[SurfaceLattice::keyOf(points[k], 0)] += cell.weights[k];
    }
    return sum;
}

std::string facingQuad(float size) {
    const std::string s = std::to_string(size);
    return "Scale " + s + " 1 " + s + R"(
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "normal N" [0 -1 0  0 -1 0  0 -1 0  0 -1 0]
  "point P" [0 0 0  1.6 0 .1  1.7 0 1.1  .1 0 1]
)";
}

/// An edge of two triangles.
struct SharedEdge {
    uint32_t from, to, prim[2];
};

std::vector<SharedEdge> findSharedEdges(const TriangleMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> firstTriangle;
    std::vector<SharedEdge> edges;
    for (uint32_t prim = 0; prim < mesh.triangleCount(); ++prim)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = mesh.indices[3 * prim + k], b = mesh.indices[3 * prim + (k + 1) % 3];
            const auto [entry, isNew] = firstTriangle.try_emplace(std::minmax(a, b), prim);
            if (!isNew)
                edges.push_back({a, b, {entry->second, prim}});
        }
    return edges;
}

/// Returns a camera ray to the position lerp(from, to, t) on the edge of triangle `prim`.
VisibilitySample sampleOnEdge(const Scene& scene, const TriangleMesh& mesh, uint32_t prim,
                              const SharedEdge& edge, float t) {
    float weights[3];
    for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t vertex = mesh.indices[3 * prim + k];
        weights[k] = vertex == edge.from ? 1 - t : vertex == edge.to ? t : 0;
    }
    return sampleAt(scene, prim, weights[1], weights[2]);
}

struct EdgeCase {
    std::string world;
    int samplesPerEdge;
    bool isCurved; ///< mesh cells of the two triangles may differ in level or direction
};

TEST(Lattice, IsContinuousAcrossASharedEdge) {
    const EdgeCase cases[] = {
        {facingQuad(1), 500, false},                       // two divided triangles
        {facingQuad(.01f), 500, false},                    // two triangles smaller than a block
        {"Scale 1.8 1.8 1.8\n" + subdivided(5), 2, true}}; // triangles about as large as a block
    size_t compared[5] = {};                               // by LatticeCell::Kind
    for (const EdgeCase& edgeCase : cases) {
        const BuiltScene built = test::build(kView + edgeCase.world);
        const Scene& scene = *built.scene;
        const TriangleMesh& mesh = *scene.groups()[0].geometries[0].placed.shape.mesh;
        for (const float blockSize : {1.f, 2.5f, 4.f, 5.f}) {
            const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
            for (const SharedEdge& edge : findSharedEdges(mesh)) {
                for (int i = 0; i < edgeCase.samplesPerEdge; ++i) {
                    const float t = random(uint64_t(i), edge.from);
                    const VisibilitySample a = sampleOnEdge(scene, mesh, edge.prim[0], edge, t);
                    const VisibilitySample b = sampleOnEdge(scene, mesh, edge.prim[1], edge, t);
                    const WeightedCell cellA = locate(scene, lattice, a), cellB = locate(scene, lattice, b);
                    if (edgeCase.isCurved &&
                        (cellA.kind != LatticeCell::Vertices || cellB.kind != cellA.kind ||
                         cellA.side.isFront != cellB.side.isFront))
                        continue;
                    std::map<uint64_t, float> weightsA, weightsB;
                    ASSERT_NEAR(interpolateWave(scene, lattice, a, &weightsA),
                                interpolateWave(scene, lattice, b, &weightsB), 3e-6);
                    ++compared[cellA.kind];
                    // Divided triangles have points at equal positions, but share only those at vertices.
                    if (cellA.kind != LatticeCell::Vertices && cellA.kind != LatticeCell::Grid)
                        continue;
                    for (const auto& [key, weight] : weightsA)
                        ASSERT_NEAR(weight, weightsB[key], 3e-6f);
                }
            }
        }
    }
    for (const int kind : {LatticeCell::Vertices, LatticeCell::Grid, LatticeCell::Lower})
        EXPECT_GT(compared[kind], 500u) << kind;
}

TEST(Lattice, IsContinuousWithinOneDivisionOfATriangle) {
    const BuiltScene built = test::build(kView + randomTriangles(60, 1.5f));
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, 1, SurfaceLattice::SmallTriangles::Shared);
    constexpr float kStep = 1e-4f;
    size_t compared = 0, inDifferentCells = 0;
    for (uint64_t i = 0; i < 200000; ++i) {
        const float u = random(i, 0), v = random(i, 1) * (1 - u), step = std::min(kStep, 1 - u - v);
        const uint32_t prim = uint32_t(i % 60);
        const VisibilitySample a = sampleAt(scene, prim, u, v);
        const VisibilitySample b = sampleAt(scene, prim, u + (i & 64 ? step : 0), v + (i & 64 ? 0 : step));
        const WeightedCell cellA = locate(scene, lattice, a), cellB = locate(scene, lattice, b);
        if (cellA.nu != cellB.nu || cellA.nv != cellB.nv || cellA.kind == LatticeCell::Grid)
            continue;
        // A cell that the third edge cuts may have a side of length 0. The slope is at most the triangle's
        // longest edge per step.
        EXPECT_NEAR(interpolateWave(scene, lattice, a), interpolateWave(scene, lattice, b), 8 * double(kStep))
            << i;
        ++compared;
        inDifferentCells += cellA.key != cellB.key;
    }
    EXPECT_GT(compared, 100000u);
    EXPECT_GT(inDifferentCells, 300u);
}

TEST(Lattice, KeysIdentifyPoints) {
    // All points of a fine division of all triangles, and of a coarser division, whose points are among them.
    const BuiltScene built = test::build(kView + R"(ObjectBegin "o"
)" + subdivided(1) + R"(
ObjectEnd
ObjectInstance "o"
Translate 1 0 0
ObjectInstance "o"
)");
    const SurfaceLattice lattice(*built.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    std::unordered_map<uint64_t, uint64_t> positionOfKey, keyOfPosition;
    const auto addPoints = [&](const LatticeCell& cell, uint32_t bin) {
        const auto points = pointsOf(lattice, cell);
        for (int k = 0; k < cell.pointCount(); ++k) {
            const LatticePoint& p = points[k];
            uint64_t position = p.prim; // all that identifies the point, in one number
            for (const uint64_t item : {uint64_t(cell.side.instance), uint64_t(cell.side.isFront),
                                        uint64_t(bin), uint64_t(p.u * 64), uint64_t(p.v * 64)})
                position = position << 8 | item;
            const uint64_t key = SurfaceLattice::keyOf(p, bin);
            ASSERT_EQ(positionOfKey.try_emplace(key, position).first->second, position);
            ASSERT_EQ(keyOfPosition.try_emplace(position, key).first->second, key);
        }
    };
    LatticeCell cell{};
    cell.kind = LatticeCell::Lower;
    for (const int n : {64, 16})
        for (uint32_t item = 0; item < 2 * 2 * 4 * 32; ++item) { // instance, side, time bin, triangle
            cell.side = {item & 1, 0, bool(item & 2)};
            cell.prim = item >> 4;
            cell.nu = cell.nv = float(n);
            for (int i = 0; i < n; ++i)
                for (int j = 0; i + j < n; ++j) {
                    cell.i = float(i);
                    cell.j = float(j);
                    addPoints(cell, item >> 2 & 3);
                }
        }
    EXPECT_GT(positionOfKey.size(), 1000000u);
}

TEST(Lattice, TranslatingTrianglesAreDividedLikeStaticOnes) {
    const std::string world = "Rotate 30 1 2 3\nScale 1 1.5 .8\n" + randomTriangles(40, 1.5f);
    const BuiltScene still = test::build(kView + world);
    const BuiltScene moving = test::build(kView + R"(
ActiveTransform EndTime
Translate .7 0 .4
ActiveTransform All
)" + world);
    ASSERT_TRUE(moving.scene->instances().at(0).motion->onlyTranslates());
    const SurfaceLattice staticLattice(*still.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    const SurfaceLattice movingLattice(*moving.scene, 1, SurfaceLattice::SmallTriangles::Shared);
    const auto samples = randomHits(*moving.scene, 20000);
    ASSERT_GT(samples.size(), 1000u);
    size_t different = 0;
    for (VisibilitySample s : samples) {
        const WeightedCell a = locate(*moving.scene, movingLattice, s);
        s.hit.instance = kNone;
        const WeightedCell b = locate(*still.scene, staticLattice, s);
        different += a.kind != b.kind || a.nu != b.nu || a.nv != b.nv;
    }
    EXPECT_LE(different, samples.size() / 1000); // rounding
}

TEST(Lattice, CellsWithEqualKeysHaveTheSamePoints) {
    const BuiltScene built =
        test::build(kView + randomTriangles(40, 1.5f) + instanced(subdivided(6)) + kSmallSphere);
    const auto samples = randomHits(*built.scene, 200000);
    for (const float blockSize : {1.f, 4.f}) {
        const SurfaceLattice lattice(*built.scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        std::unordered_map<uint64_t, std::vector<uint64_t>> pointsOfCell;
        size_t repetitions = 0;
        for (const VisibilitySample& s : samples) {
            const WeightedCell cell = locate(*built.scene, lattice, s);
            const auto points = pointsOf(lattice, cell);
            std::vector<uint64_t> keys;
            for (int k = 0; k < cell.pointCount(); ++k)
                keys.push_back(points[k] ? SurfaceLattice::keyOf(points[k], 0) : 0);
            const auto [entry, isNew] = pointsOfCell.try_emplace(cell.key, keys);
            ASSERT_EQ(entry->second, keys);
            repetitions += !isNew;
        }
        EXPECT_GT(repetitions, 10000u);
        EXPECT_GT(pointsOfCell.size(), 1000u);
    }
}

TEST(Lattice, HitsOfAChunkAreLocatedAsIfAlone) {
    const BuiltScene built = test::build(kView + randomTriangles(40, 1.5f) + instanced(subdivided(6)) +
                                         kRotating + subdivided(4) + kSmallSphere);
    const Scene& scene = *built.scene;
    const auto samples = randomHits(scene, 40000);
    int compared[5] = {}; // by LatticeCell::Kind
    for (const float blockSize : {.25f, 2.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        for (size_t first = 0; first < samples.size(); first += kSoAWidth) {
            LatticeHitSoA hits;
            const size_t size = kSoAWidth - first % 7; // full chunks and others
            for (size_t i = first; i < std::min(first + size, samples.size()); ++i)
                push_back(hits, scene, samples[i]);
            SurfaceCache surfaces = lattice.makeSurfaceCache();
            lattice.locate(hits, surfaces);
            for (int i = 0; i < hits.count; ++i) {
                const WeightedCell cell = locate(scene, lattice, samples[first + size_t(i)]);
                ASSERT_EQ(hits.key[i], cell.key);
                ASSERT_EQ(hits.kind[i], cell.kind);
                float weights[LatticeCell::kMaxPoints]{};
                LatticeCell::computeWeights(cell.kind, hits.coords.at(i), weights);
                for (int k = 0; k < LatticeCell::kMaxPoints; ++k)
                    ASSERT_EQ(weights[k], cell.weights[k]);
                ++compared[cell.kind];
            }
        }
    }
    for (const int count : compared)
        EXPECT_GT(count, 20);
}

} // namespace
} // namespace strobe
