#include "integrators/msaa_cache.h"

#include "core/hash.h"
#include "integrators/block_cache.h"
#include "integrators/surface_lattice.h"

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

/// The distinct points of one batch, found by key.
class SlotTable {
  public:
    void clear(size_t expected) {
        const size_t size = std::bit_ceil(std::max<size_t>(4 * expected, 64));
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
        m_samples.clear();
        m_table.clear(4 * batch.samples.size());
        for (const VisibilitySample& sample : batch.samples) {
            if (sample.hit && m_shared.settings.blockSize > 0) {
                planShared(sample, requests);
            } else {
                m_samples.push_back({-1, {uint32_t(requests.size())}, {}});
                requests.push_back(requestFor(m_shared.scene, batch, sample));
            }
        }
    }

    void resolve(const VisibilityBatch&, std::span<const Rgb> shaded, std::span<Rgb> values) override {
        for (Block& block : m_blocks)
            if (block.request >= 0)
                finish(block, shaded);
        for (size_t i = 0; i < values.size(); ++i) {
            const Taken& taken = m_samples[i];
            if (taken.count < 0) {
                values[i] = shaded[taken.block[0]];
                continue;
            }
            Rgb sum(0);
            for (int k = 0; k < taken.count; ++k)
                sum += m_blocks[taken.block[k]].value * taken.weight[k];
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
    /// What a sample's value is made of.
    struct Taken {
        int count; ///< of blocks; -1: a request of its own, block[0]
        uint32_t block[4];
        float weight[4];
    };

    void planShared(const VisibilitySample& sample, std::vector<ShadingRequest>& requests) {
        Stencil stencil;
        m_shared.lattice.stencil(sample, stencil);
        if (m_shared.settings.nearest)
            keepNearest(stencil);
        const int bins = m_shared.settings.timeBins;
        const uint32_t bin = uint32_t(std::min(int(sample.ray.time * float(bins)), bins - 1));
        Taken taken{0, {}, {}};
        for (int k = 0; k < stencil.count; ++k) {
            if (!(stencil.weights[k] > 0))
                continue;
            taken.block[taken.count] = blockOf(stencil.face, stencil.points[k], bin, requests);
            taken.weight[taken.count++] = stencil.weights[k];
        }
        m_samples.push_back(taken);
    }

    static void keepNearest(Stencil& stencil) {
        int best = 0;
        for (int k = 1; k < stencil.count; ++k)
            if (stencil.weights[k] > stencil.weights[best])
                best = k;
        stencil.points[0] = stencil.points[best];
        stencil.weights[0] = 1;
        stencil.count = 1;
    }

    uint32_t blockOf(const LatticeFace& face, const LatticePoint& point, uint32_t bin,
                     std::vector<ShadingRequest>& requests) {
        const uint64_t key = m_shared.settings.timeBins > 1 ? hashOf(point.key, bin) | 1 : point.key;
        const uint32_t next = uint32_t(m_blocks.size()), index = m_table.insert(key, next);
        if (index != next)
            return index;
        Block block{key, Rgb(0), -1};
        ++m_lookups;
        if (m_shared.cache.find(key, block.value)) {
            ++m_hits;
        } else {
            block.request = int64_t(requests.size());
            request(face, point, key, bin, requests);
        }
        m_blocks.push_back(block);
        return index;
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
    std::vector<Taken> m_samples;
    SlotTable m_table;
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
