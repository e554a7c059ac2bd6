// Hits of one triangle, located together.
#include "lattice/batch_lattice.h"
#include "support/lattice_hits.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

namespace strobe {
namespace {

using namespace test;

/// The first hit, and others of the same primitive.
std::vector<VisibilitySample> ofOne(const std::vector<VisibilitySample>& all) {
    std::vector<VisibilitySample> one;
    for (const VisibilitySample& s : all)
        if (s.hit.prim == all[0].hit.prim && s.hit.geometry == all[0].hit.geometry &&
            s.hit.instance == all[0].hit.instance)
            one.push_back(s);
    return one;
}

/// Hits in a window of the film, some of one primitive only, some of others, too.
std::vector<VisibilitySample> someHits(const Scene& scene, uint64_t pixelBounds) {
    const V2f from = V2f(random(pixelBounds, 40), random(pixelBounds, 41)) * 195.f;
    const auto hits = randomHits(scene, int(1 + pixelBounds % kSoAWidth), from, 4 * random(pixelBounds, 42));
    return hits.empty() || random(pixelBounds, 43) < .2f ? hits : ofOne(hits);
}

std::string things() {
    const std::string moved = "ActiveTransform EndTime\nTranslate .7 0 .4\nActiveTransform All\n";
    return randomTriangles(40, 1.5f) + randomTriangles(30, .6f, true) + moved + "Scale 1 1.2 .7\n" +
           randomTriangles(30, 1.5f, true) + subdivided(3);
}

TEST(LatticePatch, FindsEachHitAsIfAlone) {
    const BuiltScene built = test::build(kView + things());
    const Scene& scene = *built.scene;
    int patches = 0, others = 0, large = 0;
    for (const float blockSize : {.25f, 1.f, 4.f}) {
        const SurfaceLattice lattice(scene, blockSize, SurfaceLattice::SmallTriangles::Shared);
        SurfaceCache surfaces = lattice.surfaceCache();
        for (uint64_t pixelBounds = 0; pixelBounds < 20000; ++pixelBounds) {
            const auto hits = someHits(scene, pixelBounds);
            if (hits.empty())
                continue;
            const int n = int(hits.size());
            VisibilitySoA samples;
            LatticeSoA cones;
            for (int i = 0; i < n; ++i) {
                const VisibilitySample& s = hits[size_t(i)];
                const RayCone cone = scene.camera().cone(s.film);
                samples.hit.set(i, s.hit), samples.ray.d.set(i, s.ray.d);
                cones.width[i] = cone.width, cones.spread[i] = cone.spread;
            }
            LatticePatch patch;
            PatchCells places;
            V3SoA inside;
            if (!lattice.findTriangle(samples.hit, n, surfaces, patch) ||
                !lattice.divide(samples, n, cones, surfaces, patch) ||
                !places.find(patch, samples.hit, n, inside)) {
                ++others;
                continue;
            }
            std::set<uint32_t> ids;
            for (int i = 0; i < n; ++i) {
                const Located alone = locate(scene, lattice, hits[size_t(i)]);
                const uint32_t id = places.id[i];
                ASSERT_EQ(alone.face.positive, patch.positive);
                ASSERT_EQ(alone.kind, PatchCells::isUpper(id) ? LatticeCell::Upper : LatticeCell::Lower);
                ASSERT_EQ(V2f(alone.nu, alone.nv), V2f(patch.nu, patch.nv));
                ASSERT_EQ(V2f(alone.i, alone.j), V2f(float(places.columnOf(id)), float(places.rowOf(id))));
                float weights[LatticeCell::kPoints];
                LatticeCell::weigh(LatticeCell::Lower, inside.at(i), weights);
                for (int k = 0; k < 3; ++k)
                    ASSERT_EQ(weights[k], alone.weights[k]);
                ids.insert(id);
                ASSERT_LT(int(id), places.count);
            }
            for (uint32_t id = 0; id < PatchCells::kMax; ++id)
                ASSERT_EQ(places.any[id / 64] >> id % 64 & 1, ids.count(id));
            ++patches, large += ids.size() > 5;
        }
    }
    EXPECT_GT(patches, 7000);
    EXPECT_GT(large, 2000);
    EXPECT_GT(others, 2000);
}

TEST(PatchTable, TellsAllCellsApart) {
    PatchTable file;
    const LatticePatch patch{kNone, 0, 0, 1, 1024, 1024, true};
    std::set<uint64_t> tags; // of what is filed where column 3 and row 5 are
    const auto add = [&](const LatticePatch& p) {
        file.open(p);
        for (const uint32_t column : {3u, 35u, 67u, 1023u * 32 + 3})
            for (const uint32_t row : {5u, 37u, 1023u * 32 + 5}) {
                EXPECT_EQ(file.placeOf(column, row), file.placeOf(3, 5));
                EXPECT_TRUE(tags.insert(file.tagOf(column, row)).second);
                EXPECT_NE(&file.cell(column, row, true), &file.cell(column, row, false));
            }
    };
    add(patch);
    const uint64_t known = file.tagOf(3, 5);
    for (int k = 0; k < 5; ++k) {
        LatticePatch other = patch;
        if (k == 0)
            other.keySum = 2;
        else if (k == 1)
            other.nu = 512;
        else if (k == 2)
            other.nv = 2048;
        else if (k == 3)
            other.positive = false;
        else
            file.clear();
        add(other);
    }
    file.clear();
    file.open(patch);
    EXPECT_NE(file.tagOf(3, 5), known);
    const uint64_t again = file.tagOf(3, 5);
    file.open(patch);
    EXPECT_EQ(file.tagOf(3, 5), again);
}

/// Batches of hits, each block in a window of its own; the windows of a batch are neighbors.
struct Batches {
    const Scene& scene;
    SoAVector<VisibilitySoA> samples;
    std::vector<PixelRef> pixels;

    VisibilityBatch next(uint64_t number) {
        samples.clear(), pixels.clear();
        const V2f start = V2f(random(number, 50), random(number, 51)) * 190.f;
        for (uint64_t b = 0; b < 24; ++b) {
            const V2f from = start + V2f(float(b % 6), float(b / 6));
            auto hits = randomHits(scene, 2 * kSoAWidth, from, 1);
            if (hits.empty())
                continue;
            if (random(number, b + 60) < .8f)
                hits = ofOne(hits);
            const PixelRef pixel{int(from.x), int(from.y), number};
            samples.resize(samples.size() + kSoAWidth);
            VisibilitySoA& block = samples.chunk(samples.chunks() - 1);
            for (int i = 0; i < kSoAWidth; ++i) {
                const VisibilitySample& s = hits[size_t(i) % hits.size()];
                block.hit.set(i, s.hit), block.ray.d.set(i, s.ray.d), block.camera.time[i] = s.ray.time;
                block.camera.film.set(i, V2f(float(pixel.x), float(pixel.y)) + V2f(.5f));
                block.pixel[i] = uint32_t(pixels.size());
            }
            pixels.push_back(pixel);
        }
        return {pixels, samples, kSoAWidth, {0, kSoAWidth}, {0, kSoAWidth}};
    }
};

Rgb colorOf(uint64_t key) { return Rgb(random(key, 0), random(key, 1), random(key, 2)); }

class LatticePatchBatches : public testing::TestWithParam<bool> {};

/// The points that a sample takes from in its time bin.
std::set<uint64_t> keysAround(const Scene& scene, const SurfaceLattice& lattice, const VisibilitySample& s,
                              int bins) {
    std::set<uint64_t> keys;
    const Located alone = locate(scene, lattice, s);
    MeshPointCache known;
    LatticePoint points[LatticeCell::kPoints];
    lattice.points(alone, known, points);
    for (int k = 0; k < alone.count(); ++k)
        if (points[k])
            keys.insert(SurfaceLattice::keyOf(points[k], uint32_t(s.ray.time * float(bins))));
    return keys;
}

TEST_P(LatticePatchBatches, GiveWhatKeysGive) {
    constexpr int kBins = 4;
    const bool remembers = GetParam();
    const BuiltScene built = test::build(kView + things());
    const Scene& scene = *built.scene;
    const SurfaceLattice lattice(scene, .7f, SurfaceLattice::SmallTriangles::Shared);
    RadianceCache cache(1 << 16);
    BatchLattice patches(lattice, {kBins, false, remembers}, cache);
    BatchLattice keys(lattice, {kBins, false, remembers}, cache);
    Batches batches{scene, {}, {}};
    size_t inPatches = 0, inAll = 0;
    for (uint64_t number = 0; number < 300; ++number) {
        const VisibilityBatch batch = batches.next(number / 2); // twice: what is known must do as well
        int32_t lanes[kSoAWidth];
        std::iota(lanes, lanes + kSoAWidth, 0);
        patches.begin(batch), keys.begin(batch);
        for (size_t b = 0; b < batch.samples.chunks(); ++b) {
            if (patches.addPatch(batch, b))
                inPatches += kSoAWidth;
            else
                patches.addAll(batch, b);
            inAll += kSoAWidth;
            keys.addSome(batch, b, lanes, batch.samples.chunkSize(b));
        }
        patches.finish(), keys.finish();
        std::set<uint64_t> asked;
        for (const BatchLattice::Block& block : patches.blocks()) {
            ASSERT_TRUE(asked.insert(block.key).second);
            ASSERT_TRUE(keysAround(scene, lattice, batch.samples[block.sample], kBins).count(block.key));
            patches.setValue(block, colorOf(block.key));
        }
        size_t askedByKeys = 0;
        for (const BatchLattice::Block& block : keys.blocks()) {
            askedByKeys += asked.count(block.key);
            keys.setValue(block, colorOf(block.key));
        }
        if (!remembers) {
            ASSERT_EQ(asked.size(), keys.blocks().size());
            ASSERT_EQ(asked.size(), askedByKeys);
        }
        std::vector<Rgb> values(batch.samples.size()), expected(batch.samples.size());
        patches.take(values), keys.take(expected);
        ASSERT_EQ(values, expected);
        for (size_t i = 0; i < values.size(); ++i)
            ASSERT_EQ(patches.mainKeyOf(i), keys.mainKeyOf(i));
    }
    EXPECT_GT(inPatches, inAll / 4);
    EXPECT_LT(inPatches, inAll * 3 / 4);
}

INSTANTIATE_TEST_SUITE_P(, LatticePatchBatches, testing::Bool(), [](const auto& info) {
    return std::string(info.param ? "WithWhatWasKnown" : "EachAnew");
});

} // namespace
} // namespace strobe
