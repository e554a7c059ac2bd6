#include "integrators/msaa_cache.h"

#include "core/hash.h"
#include "integrators/block_cache.h"
#include "integrators/surface_lattice.h"

#include <algorithm>
#include <bit>

namespace strobe {

namespace {

const ParamDef<float> kBlockSize{"blocksize", 1,
                                 "distance of shading points in pixels; 0: every sample shades for itself"};
const ParamDef<int> kShades{"shades", 1, "shades per point, spread over the shutter"};
const ParamDef<int> kTimeBins{"timebins", 1, "parts of the shutter that are shaded apart"};
const ParamDef<std::string> kInterpolate{"interpolate", "lattice",
                                         "lattice: between the points around; nearest: the nearest"};
const ParamDef<float> kCacheMegabytes{"cache-mb", 256, "size of the cache; changes the time, never a pixel"};

struct CacheSettings {
    float blockSize;
    int shades, timeBins;
    bool nearest;
    size_t bytes;
};

/// What the workers of one render share.
struct Shared {
    Shared(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : scene(scene), settings(settings), seed(seed), lattice(scene, settings.blockSize),
          cache(settings.bytes) {}
    const Scene& scene;
    const CacheSettings settings;
    const uint64_t seed;
    const SurfaceLattice lattice;
    BlockCache cache;
};

/// The distinct cells or points of one batch, found by key.
class SlotTable {
  public:
    /// Empties the table and makes room for four items a sample at most.
    void clear(size_t samples) {
        const size_t size = std::bit_ceil(std::max<size_t>(8 * samples, 64));
        if (m_slots.size() < size)
            m_slots.assign(size, {}), m_epoch = 0;
        if (++m_epoch == 0)
            m_slots.assign(m_slots.size(), {}), m_epoch = 1;
    }
    /// The number filed under `key`, or `next`, which is then filed.
    uint32_t insert(uint64_t key, uint32_t next) {
        const size_t mask = m_slots.size() - 1;
        for (size_t i = key & mask;; i = (i + 1) & mask) {
            Slot& slot = m_slots[i];
            if (slot.epoch != m_epoch) {
                slot = {key, next, m_epoch};
                return next;
            }
            if (slot.key == key)
                return slot.index;
        }
    }

  private:
    struct Slot {
        uint64_t key = 0;
        uint32_t index = 0, epoch = 0;
    };
    std::vector<Slot> m_slots;
    uint32_t m_epoch = 0;
};

class Worker : public IntegratorWorker {
  public:
    explicit Worker(Shared& shared) : m_shared(shared) {}

    void plan(const VisibilityBatch& batch, std::vector<ShadingRequest>& requests) override {
        m_blocks.clear();
        m_places.clear();
        m_cells.clear();
        m_samples.clear();
        m_blockTable.clear(batch.samples.size());
        m_cellTable.clear(batch.samples.size());
        for (const VisibilitySample& sample : batch.samples) {
            if (sample.hit && m_shared.settings.blockSize > 0) {
                planShared(sample);
            } else {
                m_samples.push_back({-int64_t(requests.size()) - 1, {}});
                requests.push_back(requestFor(m_shared.scene, batch, sample));
            }
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
            if (taken.cell < 0) {
                values[i] = shaded[size_t(-taken.cell - 1)];
                continue;
            }
            const Cell& cell = m_cells[size_t(taken.cell)];
            Rgb sum(0);
            for (int k = 0; k < cell.count; ++k)
                sum += m_blocks[cell.block[k]].value * taken.weight[k];
            values[i] = sum;
        }
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
    };
    struct Cell {
        int count;
        uint32_t block[4];
    };
    /// What a sample's value is made of.
    struct Taken {
        int64_t cell; ///< negative: request -cell - 1, its own
        float weight[4];
    };

    void planShared(const VisibilitySample& sample) {
        LatticeCell cell = m_shared.lattice.locate(sample);
        const int bins = m_shared.settings.timeBins;
        const uint32_t bin = uint32_t(std::min(int(sample.ray.time * float(bins)), bins - 1));
        const int nearest = m_shared.settings.nearest ? heaviest(cell) : -1;
        uint64_t key = cell.key;
        if (bins > 1 || nearest >= 0)
            key = hashOf(key, bin, nearest);
        const uint32_t next = uint32_t(m_cells.size()), index = m_cellTable.insert(key, next);
        if (index == next)
            m_cells.push_back(makeCell(cell, nearest, bin));
        Taken taken{index, {1, 0, 0, 0}};
        if (nearest < 0)
            std::copy(cell.weights, cell.weights + 4, taken.weight);
        m_samples.push_back(taken);
    }

    static int heaviest(const LatticeCell& cell) {
        return int(std::max_element(cell.weights, cell.weights + cell.count) - cell.weights);
    }

    Cell makeCell(const LatticeCell& cell, int nearest, uint32_t bin) {
        LatticePoint points[4];
        m_shared.lattice.points(cell, points);
        Cell made{nearest < 0 ? cell.count : 1, {}};
        for (int k = 0; k < made.count; ++k)
            made.block[k] = blockOf(cell.face, points[nearest < 0 ? k : nearest], bin);
        return made;
    }

    /// The batch's block of a point; a new one is looked up later, when the cache's memory has arrived.
    uint32_t blockOf(const LatticeFace& face, const LatticePoint& point, uint32_t bin) {
        const uint64_t key = m_shared.settings.timeBins > 1 ? hashOf(point.key, bin) | 1 : point.key;
        const uint32_t next = uint32_t(m_blocks.size()), index = m_blockTable.insert(key, next);
        if (index == next) {
            m_shared.cache.prefetch(key);
            m_blocks.push_back({key, Rgb(0), -1});
            m_places.push_back({face, point, bin});
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
        request(place.face, place.point, block.key, place.bin, requests);
    }

    /// The shades of a block: at random times, one in each of `shades` equal parts of its time bin.
    void request(const LatticeFace& face, const LatticePoint& point, uint64_t key, uint32_t bin,
                 std::vector<ShadingRequest>& requests) const {
        const CacheSettings& settings = m_shared.settings;
        const uint64_t domain = hashOf(m_shared.seed, key);
        for (int k = 0; k < settings.shades; ++k) {
            const float jitter = unitFloat(uint32_t(hashOf(domain, k) >> 32));
            const float inBin = (float(k) + jitter) / float(settings.shades);
            ShadingRequest r = m_shared.lattice.request(
                face, point, std::min((float(bin) + inBin) / float(settings.timeBins), kOneMinusEpsilon));
            r.domain = domain;
            r.index = uint32_t(k);
            r.total = uint32_t(settings.shades);
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
    std::vector<Block> m_blocks;
    std::vector<Place> m_places; ///< beside m_blocks
    std::vector<Cell> m_cells;
    std::vector<Taken> m_samples;
    SlotTable m_blockTable, m_cellTable;
    uint64_t m_lookups = 0, m_hits = 0, m_duplicates = 0, m_evictions = 0;
};

class CacheRender : public IntegratorRender {
  public:
    CacheRender(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : m_shared(scene, settings, seed) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override { return std::make_unique<Worker>(m_shared); }

  private:
    Shared m_shared;
};

class MsaaCache : public Integrator {
  public:
    explicit MsaaCache(const ParamSet& params) {
        const std::string interpolate = params.get(kInterpolate);
        if (interpolate != "lattice" && interpolate != "nearest")
            throw Error(params.whereIs(kInterpolate),
                        "\"interpolate\" must be \"lattice\" or \"nearest\", not \"" + interpolate + "\"");
        for (const ParamDef<int>* def : {&kShades, &kTimeBins})
            if (params.get(*def) < 1)
                throw Error(params.whereIs(*def), std::string("\"") + def->name + "\" must be at least 1");
        for (const ParamDef<float>* def : {&kBlockSize, &kCacheMegabytes})
            if (!(params.get(*def) >= 0))
                throw Error(params.whereIs(*def), std::string("\"") + def->name + "\" must not be negative");
        m_settings = {params.get(kBlockSize), params.get(kShades), params.get(kTimeBins),
                      interpolate == "nearest", size_t(double(params.get(kCacheMegabytes)) * 1024 * 1024)};
    }
    std::unique_ptr<IntegratorRender> begin(const Scene& scene, uint64_t seed) const override {
        return std::make_unique<CacheRender>(scene, m_settings, seed);
    }

  private:
    CacheSettings m_settings;
};

} // namespace

IntegratorPlugin msaaCachePlugin() {
    return {"msaa-cache",
            "samples of any pixel and time share the shading points around them; biased by the block's size",
            {kBlockSize, kShades, kTimeBins, kInterpolate, kCacheMegabytes},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const MsaaCache>(params);
            }};
}

} // namespace strobe
