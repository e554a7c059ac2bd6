#include "core/hash.h"
#include "integrators/block_cache.h"
#include "integrators/cache_settings.h"
#include "integrators/slot_table.h"
#include "integrators/surface_lattice.h"

#include <bit>

namespace strobe {

namespace {

/// What the workers of one render share.
struct Shared {
    Shared(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : scene(scene), settings(settings), seed(seed),
          lattice(scene, settings.blockSize, SurfaceLattice::SmallTriangles::Shared), cache(settings.bytes) {}
    const Scene& scene;
    const CacheSettings settings;
    const uint64_t seed;
    const SurfaceLattice lattice;
    BlockCache cache;
};

class Worker : public IntegratorWorker {
  public:
    explicit Worker(Shared& shared) : m_shared(shared) {}

    void plan(const VisibilityBatch& batch, std::vector<ShadingRequest>& requests) override {
        m_blocks.clear();
        m_places.clear();
        m_cells.clear();
        m_samples.clear();
        m_blockTable.clear();
        m_cellTable.clear();
        uint32_t pixel = ~0u;
        for (const VisibilitySample& sample : batch.samples) {
            if (sample.pixel != pixel) {
                pixel = sample.pixel;
                m_cone = m_shared.lattice.coneOf(batch.pixels[pixel]);
            }
            const bool shares = sharesAt(sample.hit), indirectOnly = m_shared.settings.indirectOnly;
            Taken& taken = m_samples.emplace_back();
            const auto ask = [&](LightPart part) {
                requests.push_back(requestFor(m_shared.scene, batch, sample));
                requests.back().part = part;
                return int64_t(requests.size()) - 1;
            };
            if (!shares || indirectOnly)
                taken.own = ask(shares ? LightPart::Direct : LightPart::All);
            if (shares && indirectOnly && materialOf(sample.hit).isTextured())
                taken.albedo = ask(LightPart::Albedo);
            if (shares)
                planShared(sample, uint32_t(&sample - batch.samples.data()), taken);
        }
        for (size_t i = 0; i < m_blocks.size(); ++i)
            lookUp(m_blocks[i], m_places[i], requests);
    }

    void resolve(const VisibilityBatch&, std::span<const Rgb> shaded, std::span<Rgb> values) override {
        for (Block& block : m_blocks)
            if (block.request >= 0)
                finish(block, shaded);
        for (size_t i = 0; i < values.size(); ++i) {
            const Taken& taken = m_samples[i];
            values[i] = taken.own >= 0 ? shaded[size_t(taken.own)] : Rgb(0);
            if (taken.cell < 0)
                continue;
            const Cell& cell = m_cells[size_t(taken.cell)];
            Rgb sum(0);
            float weights = 0;
            for (int k = 0; k < cell.count; ++k) {
                const float weight = taken.weight[cell.weightOf[k]];
                sum += m_blocks[cell.block[k]].value * weight;
                weights += weight;
            }
            sum *= 1 / weights;
            values[i] += taken.albedo >= 0 ? sum * shaded[size_t(taken.albedo)] : sum;
        }
    }

    uint64_t blockOf(size_t sample) const override {
        const Taken& taken = m_samples[sample];
        if (taken.cell < 0)
            return 0;
        const Cell& cell = m_cells[size_t(taken.cell)];
        int heaviest = 0;
        for (int k = 1; k < cell.count; ++k)
            if (taken.weight[cell.weightOf[k]] > taken.weight[cell.weightOf[heaviest]])
                heaviest = k;
        return m_blocks[cell.block[heaviest]].key;
    }

    void report(Counters& counters) const override {
        counters.blockLookups += m_lookups;
        counters.blockHits += m_hits;
        counters.blockDuplicates += m_duplicates;
        counters.blockEvictions += m_evictions;
        counters.cacheBytes = m_shared.cache.bytes();
    }

  private:
    struct Block {
        uint64_t key;
        Rgb value;
        int64_t request; ///< the first of its requests; -1: it was in the cache
    };
    /// Where a block of the batch lies.
    struct Place {
        LatticeFace face;
        LatticePoint point;
        uint32_t bin;
        uint32_t sample; ///< the first to ask for it
    };
    static constexpr int kPoints = LatticeCell::kPoints;
    struct Cell {
        uint8_t count = 0;
        uint8_t weightOf[kPoints]; ///< which of a sample's weights is the block's
        uint32_t block[kPoints];
    };
    /// What a sample's value is made of.
    struct Taken {
        int64_t own = -1;    ///< the request that it made for itself, if any
        int64_t albedo = -1; ///< the request for the factor of what it shares; negative: 1
        int64_t cell = -1;   ///< negative: none
        float weight[kPoints];
    };

    bool sharesAt(const Hit& hit) const {
        const CacheSettings& settings = m_shared.settings;
        if (!hit || settings.blockSize == 0)
            return false;
        return !settings.indirectOnly || materialOf(hit).isDiffuse();
    }

    const Material& materialOf(const Hit& hit) const {
        const Scene& scene = m_shared.scene;
        return *scene.materials()[size_t(scene.geometry(hit).material)];
    }

    void planShared(const VisibilitySample& sample, uint32_t index, Taken& taken) {
        const int bins = m_shared.settings.timeBins;
        const uint32_t bin = uint32_t(std::min(int(sample.ray.time * float(bins)), bins - 1));
        const LatticeCell cell = m_shared.lattice.locate(sample, m_cone, bin);
        const int nearest = m_shared.settings.nearest ? heaviest(cell) : -1;
        const uint64_t key = nearest >= 0 ? hashOf(cell.key, nearest) : cell.key;
        const uint32_t next = uint32_t(m_cells.size()), filed = m_cellTable.insert(key, next);
        if (filed == next)
            m_cells.push_back(makeCell(cell, nearest, bin, index));
        taken.cell = filed;
        std::copy_n(cell.weights, cell.count, taken.weight);
    }

    static int heaviest(const LatticeCell& cell) {
        return int(std::max_element(cell.weights, cell.weights + cell.count) - cell.weights);
    }

    Cell makeCell(const LatticeCell& cell, int nearest, uint32_t bin, uint32_t sample) {
        LatticePoint points[kPoints];
        m_shared.lattice.points(cell, bin, points);
        Cell made;
        const auto add = [&](int k) {
            made.weightOf[made.count] = uint8_t(k);
            made.block[made.count++] = blockAt(cell.face, points[k], bin, sample);
        };
        if (nearest >= 0) {
            add(standIn(points, cell.count, nearest));
        } else {
            for (int k = 0; k < cell.count; ++k)
                if (points[k].key)
                    add(k);
        }
        return made;
    }

    /// A point that there is: the one wanted, or of the others, which are a grid cell's, the one fewest edges
    /// away.
    static int standIn(const LatticePoint* points, int count, int wanted) {
        int best = wanted, fewest = points[wanted].key ? 0 : count;
        for (int k = 0; k < count; ++k)
            if (const int edges = std::popcount(unsigned(k ^ wanted)); points[k].key && edges < fewest)
                best = k, fewest = edges;
        return best;
    }

    /// The batch's block of a point; a new one is looked up later, when the cache's memory has arrived.
    uint32_t blockAt(const LatticeFace& face, const LatticePoint& point, uint32_t bin, uint32_t sample) {
        const uint32_t next = uint32_t(m_blocks.size()), index = m_blockTable.insert(point.key, next);
        if (index == next) {
            m_shared.cache.prefetch(point.key);
            m_blocks.push_back({point.key, Rgb(0), -1});
            m_places.push_back({face, point, bin, sample});
        }
        return index;
    }

    void lookUp(Block& block, const Place& place, std::vector<ShadingRequest>& requests) {
        ++m_lookups;
        if (m_shared.cache.find(block.key, block.value)) {
            ++m_hits;
            return;
        }
        block.request = int64_t(requests.size());
        request(place, block.key, requests);
    }

    /// The shades of a block: at random times, one in each of `shades` equal parts of its time bin, and
    /// through random points of the lens.
    void request(const Place& place, uint64_t key, std::vector<ShadingRequest>& requests) const {
        const CacheSettings& settings = m_shared.settings;
        const uint64_t domain = hashOf(m_shared.seed, key);
        for (int k = 0; k < settings.shades; ++k) {
            const uint64_t random = hashOf(domain, k), more = mix64(random);
            const float inBin = (float(k) + unitFloat(uint32_t(random >> 32))) / float(settings.shades);
            const float time = (float(place.bin) + inBin) / float(settings.timeBins);
            ShadingRequest r =
                m_shared.lattice.request(place.face, place.point, std::min(time, kOneMinusEpsilon),
                                         V2f(unitFloat(uint32_t(more)), unitFloat(uint32_t(more >> 32))));
            r.domain = domain;
            r.index = uint32_t(k);
            r.total = uint32_t(settings.shades);
            r.sample = place.sample;
            r.part = settings.indirectOnly ? LightPart::Indirect : LightPart::All;
            requests.push_back(r);
        }
    }

    void finish(Block& block, std::span<const Rgb> shaded) {
        Rgb sum(0);
        for (int k = 0; k < m_shared.settings.shades; ++k)
            sum += shaded[size_t(block.request + k)];
        block.value = sum * (1 / float(m_shared.settings.shades));
        switch (m_shared.cache.store(block.key, block.value)) {
        case BlockCache::Stored::Fresh:
            break;
        case BlockCache::Stored::Duplicate:
            ++m_duplicates;
            break;
        case BlockCache::Stored::Evicting:
            ++m_evictions;
            break;
        }
    }

    Shared& m_shared;
    RayCone m_cone; ///< of the pixel whose samples are being planned
    std::vector<Block> m_blocks;
    std::vector<Place> m_places; ///< beside m_blocks
    std::vector<Cell> m_cells;
    std::vector<Taken> m_samples;
    SlotTable m_blockTable, m_cellTable;
    uint64_t m_lookups = 0, m_hits = 0, m_duplicates = 0, m_evictions = 0;
};

class LatticeRender : public IntegratorRender {
  public:
    LatticeRender(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : m_shared(scene, settings, seed) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override { return std::make_unique<Worker>(m_shared); }

  private:
    Shared m_shared;
};

} // namespace

std::unique_ptr<IntegratorRender> beginLatticeSharing(const Scene& scene, const CacheSettings& settings,
                                                      uint64_t seed) {
    return std::make_unique<LatticeRender>(scene, settings, seed);
}

} // namespace strobe
