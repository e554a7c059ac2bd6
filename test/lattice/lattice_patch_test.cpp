// Patches: hits of one triangle that are located together.
#include "lattice/batch_lattice.h"
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

namespace strobe {
namespace {

using namespace test;

/// Returns the samples on the same primitive as the first.
std::vector<VisibilitySample> onFirstPrimitive(const std::vector<VisibilitySample>& samples) {
    std::vector<VisibilitySample> result;
    const Hit& first = samples[0].hit;
    for (const VisibilitySample& s : samples)
        if (s.hit.prim == first.prim && s.hit.geometry == first.geometry && s.hit.instance == first.instance)
            result.push_back(s);
    return result;
}

/// Returns hits in a random square of the film; for most numbers on one primitive, for others on several.
std::vector<VisibilitySample> randomChunk(const Scene& scene, uint64_t number) {
    const V2f corner = V2f(random(number, 40), random(number, 41)) * 195.f;
    const auto samples = randomHits(scene, int(1 + number % kSoAWidth), corner, 4 * random(number, 42));
    return samples.empty() || random(number, 43) < .2f ? samples : onFirstPrimitive(samples);
}

const std::string kManyTriangles = randomTriangles(40, 1.5f) + randomTriangles(30, .6f, true) + R"(
ActiveTransform EndTime
Translate .7 0 .4
ActiveTransform All
Scale 1 1.2 .7
)" + randomTriangles(30, 1.5f, true) +
                                   subdivided(3);

/// Expects that each sample's cell in the patch is the cell that SurfaceLattice::locate finds. Returns the
/// number of cells.
size_t expectSameCells(const Scene& scene, const SurfaceLattice& lattice, const LatticePatch& patch,
                       const PatchCells& cells, const V3SoA& coords,
                       const std::vector<VisibilitySample>& samples) {
    std::set<uint32_t> ids;
    for (int i = 0; i < int(samples.size()); ++i) {
        const WeightedCell cell = locate(scene, lattice, samples[size_t(i)]);
        const uint32_t id = cells.idOf(i);
        EXPECT_EQ(cell.side.isFront, patch.isFront);
        EXPECT_EQ(cell.kind, PatchCells::isUpper(id) ? LatticeCell::Upper : LatticeCell::Lower);
        EXPECT_EQ(V2f(cell.nu, cell.nv), V2f(patch.nu, patch.nv));
        EXPECT_EQ(V2f(cell.i, cell.j), V2f(float(cells.columnOf(id)), float(cells.rowOf(id))));
        float weights[LatticeCell::kMaxPoints];
        LatticeCell::computeWeights(LatticeCell::Lower, coords.at(i), weights);
        for (int k = 0; k < 3; ++k)
            EXPECT_EQ(weights[k], cell.weights[k]);
        ids.insert(id);
        EXPECT_LT(int(id), cells.idCount());
    }
    for (uint32_t id = 0; id < PatchCells::kMaxIds; ++id)
        EXPECT_EQ(cells.occupied()[id / 64] >> id % 64 & 1, ids.count(id));
    return ids.size();
}

TEST(LatticePatch, CellsAreThoseOfEachHitByItself) {
    const BuiltScene built = test::build(kView + kManyTriangles);
    const Scene& scene = *built.scene;
    int patches = 0, otherChunks = 0, largePatches = 0;
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        SurfaceCache surfaces = lattice.makeSurfaceCache();
        for (uint64_t number = 0; number < 20000; ++number) {
            const auto chunk = randomChunk(scene, number);
            if (chunk.empty())
                continue;
            const int n = int(chunk.size());
            VisibilitySoA samples;
            RayConeSoA cones;
            for (int i = 0; i < n; ++i) {
                const VisibilitySample& s = chunk[size_t(i)];
                samples.hit.set(i, s.hit);
                samples.ray.d.set(i, s.ray.d);
                cones.set(i, scene.camera().cone(s.film));
            }
            LatticePatch patch;
            PatchCells cells;
            V3SoA coords;
            if (!lattice.findCommonTriangle(samples.hit, n, surfaces, patch) ||
                !lattice.findCommonDivision(samples, n, cones, surfaces, patch) ||
                !cells.find(patch, samples.hit, n, coords)) {
                ++otherChunks;
                continue;
            }
            const size_t cellCount = expectSameCells(scene, lattice, patch, cells, coords, chunk);
            ASSERT_FALSE(HasFailure());
            ++patches;
            largePatches += cellCount > 5;
        }
    }
    EXPECT_GT(patches, 7000);
    EXPECT_GT(largePatches, 2000);
    EXPECT_GT(otherChunks, 2000);
}

TEST(PatchTable, TagsDistinguishPatchesAndTiles) {
    PatchTable table;
    const LatticePatch patch{kNone, 0, 0, 1, 1024, 1024, true};
    std::set<uint64_t> tags; // of entries with the index of column 3 and row 5
    const auto expectNewTags = [&](const LatticePatch& p) {
        table.select(p);
        for (const uint32_t column : {3u, 35u, 67u, 1023u * 32 + 3})
            for (const uint32_t row : {5u, 37u, 1023u * 32 + 5}) {
                EXPECT_EQ(table.nodeIndex(column, row), table.nodeIndex(3, 5));
                EXPECT_TRUE(tags.insert(table.tagOf(column, row)).second);
                EXPECT_NE(&table.cell(column, row, true), &table.cell(column, row, false));
            }
    };
    expectNewTags(patch);
    const uint64_t tagBeforeClear = table.tagOf(3, 5);
    LatticePatch otherKey = patch, otherColumns = patch, otherRows = patch, otherSide = patch;
    otherKey.keySum = 2;
    otherColumns.nu = 512;
    otherRows.nv = 2048;
    otherSide.isFront = false;
    for (const LatticePatch& other : {otherKey, otherColumns, otherRows, otherSide})
        expectNewTags(other);
    table.clear();
    expectNewTags(patch);
    table.clear();
    table.select(patch);
    EXPECT_NE(table.tagOf(3, 5), tagBeforeClear);
    const uint64_t tag = table.tagOf(3, 5);
    table.select(patch);
    EXPECT_EQ(table.tagOf(3, 5), tag);
}

/// Batches of hits. Each chunk is in a pixel of its own; the pixels of a batch are neighbors.
struct RandomBatches {
    const Scene& scene;
    SoAVector<VisibilitySoA> samples;
    std::vector<PixelRef> pixels;

    VisibilityBatch makeBatch(uint64_t number) {
        samples.clear();
        pixels.clear();
        const V2f start = V2f(random(number, 50), random(number, 51)) * 190.f;
        for (uint64_t c = 0; c < 24; ++c) {
            const V2f corner = start + V2f(float(c % 6), float(c / 6));
            auto hits = randomHits(scene, 2 * kSoAWidth, corner, 1);
            if (hits.empty())
                continue;
            if (random(number, c + 60) < .8f)
                hits = onFirstPrimitive(hits);
            const PixelRef pixel{int(corner.x), int(corner.y), number};
            samples.resize(samples.size() + kSoAWidth);
            VisibilitySoA& chunk = samples.chunk(samples.chunks() - 1);
            for (int i = 0; i < kSoAWidth; ++i) {
                const VisibilitySample& s = hits[size_t(i) % hits.size()];
                chunk.hit.set(i, s.hit);
                chunk.ray.d.set(i, s.ray.d);
                chunk.camera.time[i] = s.ray.time;
                chunk.camera.film.set(i, V2f(float(pixel.x), float(pixel.y)) + V2f(.5f));
                chunk.pixel[i] = uint32_t(pixels.size());
            }
            pixels.push_back(pixel);
        }
        return {pixels, samples, kSoAWidth, {0, kSoAWidth}, {0, kSoAWidth}};
    }
};

Rgb radianceOf(uint64_t key) { return Rgb(random(key, 0), random(key, 1), random(key, 2)); }

/// Returns the keys of the points of a sample's cell in its time bin.
std::set<uint64_t> keysAround(const Scene& scene, const SurfaceLattice& lattice, const VisibilitySample& s,
                              int timeBins) {
    std::set<uint64_t> keys;
    const WeightedCell cell = locate(scene, lattice, s);
    MeshPointCache cache;
    LatticePoint points[LatticeCell::kMaxPoints];
    lattice.findPoints(cell, cache, points);
    for (int k = 0; k < cell.pointCount(); ++k)
        if (points[k])
            keys.insert(SurfaceLattice::keyOf(points[k], uint32_t(s.ray.time * float(timeBins))));
    return keys;
}

/// The parameter is BatchLattice::Settings::keepsValues.
class BatchLatticeTest : public testing::TestWithParam<bool> {
  protected:
    static constexpr int kTimeBins = 4;
    const BuiltScene built = test::build(kView + kManyTriangles);
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice{scene, .7f, SurfaceLattice::SmallTriangles::Shared};
    RadianceCache cache{1 << 16};
    BatchLattice withPatches{lattice, {kTimeBins, false, GetParam()}, cache};
    BatchLattice withoutPatches{lattice, {kTimeBins, false, GetParam()}, cache};
    size_t samplesInPatches = 0, sampleCount = 0;

    /// Adds the same samples to both.
    void add(const VisibilityBatch& batch) {
        int32_t all[kSoAWidth];
        std::iota(all, all + kSoAWidth, 0);
        withPatches.begin(batch);
        withoutPatches.begin(batch);
        for (size_t c = 0; c < batch.samples.chunks(); ++c) {
            if (withPatches.addPatch(batch, c))
                samplesInPatches += kSoAWidth;
            else
                withPatches.addChunk(batch, c);
            sampleCount += kSoAWidth;
            withoutPatches.addSamples(batch, c, all, batch.samples.chunkSize(c));
        }
        withPatches.finish();
        withoutPatches.finish();
    }
    /// Sets the values of all shading points to functions of their keys, and checks the requests.
    void setValues(const VisibilityBatch& batch) {
        std::set<uint64_t> requested;
        for (const ShadingPoint& p : withPatches.shadingPoints()) {
            ASSERT_TRUE(requested.insert(p.key).second);
            ASSERT_TRUE(keysAround(scene, lattice, batch.samples[p.sample], kTimeBins).count(p.key));
            withPatches.setValue(p, radianceOf(p.key));
        }
        size_t requestedByBoth = 0;
        for (const ShadingPoint& p : withoutPatches.shadingPoints()) {
            requestedByBoth += requested.count(p.key);
            withoutPatches.setValue(p, radianceOf(p.key));
        }
        const bool keepsValues = GetParam();
        if (!keepsValues) {
            ASSERT_EQ(requested.size(), withoutPatches.shadingPoints().size());
            ASSERT_EQ(requested.size(), requestedByBoth);
        }
    }
};

TEST_P(BatchLatticeTest, PatchesDoNotChangeTheResult) {
    RandomBatches batches{scene, {}, {}};
    for (uint64_t number = 0; number < 300; ++number) {
        const VisibilityBatch batch =
            batches.makeBatch(number / 2); // twice: the second finds all in the table
        add(batch);
        setValues(batch);
        ASSERT_FALSE(HasFatalFailure());
        std::vector<Rgb> values(batch.samples.size()), expected(batch.samples.size());
        withPatches.interpolate(values);
        withoutPatches.interpolate(expected);
        ASSERT_EQ(values, expected);
        for (size_t i = 0; i < values.size(); ++i)
            ASSERT_EQ(withPatches.mainKeyOf(i), withoutPatches.mainKeyOf(i));
    }
    EXPECT_GT(samplesInPatches, sampleCount / 4);
    EXPECT_LT(samplesInPatches, sampleCount * 3 / 4);
}

INSTANTIATE_TEST_SUITE_P(, BatchLatticeTest, testing::Bool(), [](const auto& info) {
    return std::string(info.param ? "KeepingValues" : "WithoutKeepingValues");
});

} // namespace
} // namespace strobe
