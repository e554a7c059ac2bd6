#include "core/math/hash.h"
#include "integrators/cache_settings.h"
#include "lattice/batch_lattice.h"

#include <numeric>

namespace strobe {

namespace {

STROBE_TARGET_CLONES bool anyMisses(const HitSoA& hit, int n) {
    int32_t misses = 0;
    for (int i = 0; i < n; ++i)
        misses |= hit.geometry[i] == kNone;
    return misses;
}

/// What the workers of one render share.
struct Shared {
    Shared(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : scene(scene), settings(settings), seed(seed),
          lattice(scene, settings.blockSize, SurfaceLattice::SmallTriangles::Shared), cache(settings.bytes) {
        for (const auto& m : scene.materials()) {
            const bool shares = settings.blockSize > 0 && (!settings.indirectOnly || m->flags().diffuse);
            materials.push_back({shares, m->flags().textured});
            allShare &= shares, hasTextures |= m->flags().textured;
        }
    }
    struct Kind {
        bool shares, isTextured;
    };
    const Kind& materialAt(const HitSoA& hit, int i) const {
        return materials[size_t(scene.geometry({hit.instance[i], hit.geometry[i]}).material)];
    }
    /// Those of n samples that share. Returns how many there are.
    int findSharing(const HitSoA& hit, int n, int32_t* lanes) const {
        if (allShare && !anyMisses(hit, n)) {
            std::iota(lanes, lanes + n, 0);
            return n;
        }
        int count = 0;
        for (int i = 0; i < n; ++i) {
            lanes[count] = i;
            count += hit.geometry[i] != kNone && materialAt(hit, i).shares;
        }
        return count;
    }

    const Scene& scene;
    CacheSettings settings;
    uint64_t seed;
    const SurfaceLattice lattice;
    RadianceCache cache;
    std::vector<Kind> materials;
    bool allShare = true, hasTextures = false; ///< of the materials: all, any
};

/// Draws the times and places on the lens of points, in time bins `bin`, and what else is random of their
/// requests, from number `at` on; of these, `domain` is the key of the block.
STROBE_TARGET_CLONES void drawShades(uint64_t seed, const CacheSettings& settings, RequestSoA& out, int at,
                                     ShadedPointSoA& points, const uint32_t* bin) {
    const int n = points.count;
    const float bins = float(settings.timeBins), shades = float(settings.shades);
    const uint32_t total = uint32_t(settings.shades);
    const LightComponent component = settings.indirectOnly ? LightComponent::Indirect : LightComponent::All;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const uint64_t domain = hashOf(seed, out.domain[at + i]);
        const uint64_t random = hashOf(domain, out.index[at + i]), more = mix64(random);
        const float inBin = (float(int32_t(out.index[at + i])) + unitFloat(uint32_t(random >> 32))) / shades;
        points.time[i] = std::min((float(int32_t(bin[i])) + inBin) / bins, kOneMinusEpsilon);
        points.lens.x[i] = unitFloat(uint32_t(more)), points.lens.y[i] = unitFloat(uint32_t(more >> 32));
        out.domain[at + i] = domain, out.total[at + i] = total;
    }
    std::fill_n(out.component + at, n, component);
}

class Worker : public IntegratorWorker {
  public:
    explicit Worker(Shared& shared)
        : m_shared(shared),
          m_lattice(shared.lattice,
                    {shared.settings.timeBins, shared.settings.nearest, shared.settings.lightComponents == 0},
                    shared.cache),
          m_surfaces(shared.lattice.surfaceCache()) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_lattice.begin(batch);
        m_alone.clear();
        m_albedos.clear();
        if (m_shared.settings.indirectOnly)
            requestForEach(m_shared.scene, batch, requests);
        for (size_t b = 0; b < batch.samples.chunks(); ++b)
            planBlock(batch, b, requests);
        m_lattice.finish();
        m_requestOf.clear();
        m_components.clear();
        m_missing.clear();
        for (const Block& block : m_lattice.blocks())
            lookUp(block, requests.size());
        request(requests);
    }

    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        const std::span<const Block> blocks = m_lattice.blocks();
        constexpr size_t kAhead = 8;
        for (size_t k = 0; k < m_missing.size(); ++k) {
            if (k + kAhead < m_missing.size()) // what was there when planning may be gone
                m_shared.cache.prefetch(blocks[m_missing[k + kAhead]].key);
            const uint32_t i = m_missing[k];
            finish(blocks[i], meanFrom(m_requestOf[i], shaded));
        }
        gather(shaded, values);
        return values;
    }

    std::span<const Rgb> resolveComponent(const VisibilityBatch&, std::span<const Rgb> shaded,
                                          std::span<Rgb> values, int component) override {
        const std::span<const Block> blocks = m_lattice.blocks();
        for (size_t i = 0; i < blocks.size(); ++i) {
            if (m_requestOf[i] < 0) {
                m_lattice.setValue(
                    blocks[i],
                    m_components[i * size_t(m_shared.settings.lightComponents) + size_t(component)]);
                continue;
            }
            const Rgb value = meanFrom(m_requestOf[i], shaded);
            m_lattice.setValue(blocks[i], value);
            m_shared.cache.store(keyOfComponent(blocks[i].key, component), value);
        }
        gather(shaded, values);
        return values;
    }

    uint64_t sharingId(size_t sample) const override {
        return m_lattice.has(sample) ? m_lattice.mainKeyOf(sample) : 0;
    }

    void report(Counters& counters) const override {
        counters.cacheLookups += m_lookups;
        counters.cacheHits += m_hits;
        counters.cacheDuplicates += m_duplicates;
        counters.cacheEvictions += m_evictions;
        counters.cacheBytes = m_shared.cache.bytes();
    }

  private:
    using Block = BatchLattice::Block;
    /// What a sample asked for itself.
    struct Own {
        uint32_t sample, request;
    };

    /// What samples take of their own shades and of the blocks around.
    void gather(std::span<const Rgb> shaded, std::span<Rgb> values) {
        m_lattice.take(values);
        for (const Own& own : m_albedos)
            values[own.sample] *= shaded[own.request];
        if (m_shared.settings.indirectOnly) // each sample's own are the first requests
            for (size_t i = 0; i < values.size(); ++i)
                values[i] += shaded[i];
        for (const Own& own : m_alone)
            values[own.sample] = shaded[own.request];
    }

    /// Tells which samples of the batch's block b share, and adds them to the lattice. The others ask for
    /// themselves.
    void planBlock(const VisibilityBatch& batch, size_t b, ShadingRequests& requests) {
        const HitSoA& hit = batch.samples.chunk(b).hit;
        const int n = batch.samples.chunkSize(b);
        const bool inPatch = m_shared.allShare && m_lattice.addPatch(batch, b);
        if (inPatch && !m_shared.settings.indirectOnly)
            return;
        int32_t sharing[kSoAWidth];
        const int count = m_shared.findSharing(hit, n, sharing);
        if (m_shared.settings.indirectOnly)
            askForDirect(hit, b, sharing, count, requests);
        else if (count < n)
            askAlone(batch, b, sharing, count, requests);
        if (inPatch)
            return;
        if (count == n)
            m_lattice.addAll(batch, b);
        else
            m_lattice.addSome(batch, b, sharing, count);
    }

    /// Of the requests that the samples of a block made for themselves, those of sharing ones are for direct
    /// light, and for the albedo where that is textured.
    void askForDirect(const HitSoA& hit, size_t b, const int32_t* sharing, int count,
                      ShadingRequests& requests) {
        for (int k = 0; k < count; ++k)
            requests.chunk(b).component[sharing[k]] = LightComponent::Direct;
        if (!m_shared.hasTextures)
            return;
        for (int k = 0; k < count; ++k) {
            const uint32_t sample = uint32_t(b * kSoAWidth) + uint32_t(sharing[k]);
            if (!m_shared.materialAt(hit, sharing[k]).isTextured)
                continue;
            m_albedos.push_back({sample, uint32_t(requests.size())});
            ShadingRequest albedo = requests[sample];
            albedo.component = LightComponent::Albedo;
            requests.push_back(albedo);
        }
    }

    /// Those that do not share shade as without sharing.
    void askAlone(const VisibilityBatch& batch, size_t b, const int32_t* sharing, int count,
                  ShadingRequests& requests) {
        for (int i = 0, k = 0; i < batch.samples.chunkSize(b); ++i) {
            if (k < count && sharing[k] == i) {
                ++k;
                continue;
            }
            const uint32_t sample = uint32_t(b * kSoAWidth) + uint32_t(i);
            m_alone.push_back({sample, uint32_t(requests.size())});
            requests.push_back(requestFor(m_shared.scene, batch, batch.samples[sample]));
        }
    }

    /// Takes the block's value from the cache, or notes that it is missing; its requests will come after
    /// so many.
    void lookUp(const Block& block, size_t requests) {
        ++m_lookups;
        Rgb value;
        const bool found = m_shared.cache.find(block.key, value);
        if (findComponents(block.key) && found) {
            ++m_hits;
            m_lattice.setValue(block, value);
            m_requestOf.push_back(-1);
            return;
        }
        const size_t before = m_missing.size() * size_t(m_shared.settings.shades);
        m_missing.push_back(uint32_t(m_requestOf.size()));
        m_requestOf.push_back(int32_t(requests + before));
    }

    /// Appends the parts of a block to m_components; false if the cache does not have them all.
    bool findComponents(uint64_t key) {
        bool all = true;
        for (int component = 0; component < m_shared.settings.lightComponents; ++component)
            all &= m_shared.cache.find(keyOfComponent(key, component), m_components.emplace_back(0));
        return all;
    }
    static uint64_t keyOfComponent(uint64_t key, int component) { return hashOf(key, component) | 1; }

    /// Appends the shades of the missing blocks: at random times, one in each of `shades` equal parts of
    /// their time bins, and through random points of the lens.
    void request(ShadingRequests& requests) {
        const size_t shades = size_t(m_shared.settings.shades), end = m_missing.size() * shades;
        for (size_t next = 0; next < end; next += size_t(m_points.count)) {
            const size_t at = requests.size() % kSoAWidth;
            m_points.count = int(std::min(end - next, kSoAWidth - at));
            requests.resize(requests.size() + size_t(m_points.count));
            RequestSoA& out = requests.chunk(requests.chunks() - 1);
            for (int i = 0; i < m_points.count; ++i) {
                const size_t shade = next + size_t(i), missing = shades == 1 ? shade : shade / shades;
                setRow(m_lattice.blocks()[m_missing[missing]], uint32_t(shade - missing * shades), i, out,
                       int(at) + i);
            }
            drawShades(m_shared.seed, m_shared.settings, out, int(at), m_points, m_bin);
            m_shared.lattice.request(m_points, m_surfaces, out, int(at));
        }
    }

    /// A block's shade number k becomes number i of the points, and is drawn as number `to` of the requests.
    void setRow(const Block& block, uint32_t k, int i, RequestSoA& out, int to) {
        const LatticeFace& face = m_lattice.faceOf(block);
        const LatticePoint& place = m_lattice.pointOf(block);
        m_points.isVertex[i] = place.isVertex;
        m_points.hit.set(i, {face.instance, face.geometry, place.prim, place.u, place.v, 0});
        m_points.positive[i] = face.positive;
        m_bin[i] = m_lattice.binOf(block);
        out.domain[to] = block.key, out.index[to] = k, out.sample[to] = block.sample;
    }

    Rgb meanFrom(int32_t request, std::span<const Rgb> shaded) const {
        Rgb sum(0);
        for (int k = 0; k < m_shared.settings.shades; ++k)
            sum += shaded[size_t(request + k)];
        return sum * (1 / float(m_shared.settings.shades));
    }

    void finish(const Block& block, const Rgb& value) {
        m_lattice.setValue(block, value);
        switch (m_shared.cache.store(block.key, value)) {
        case RadianceCache::Stored::Fresh:
            break;
        case RadianceCache::Stored::Duplicate:
            ++m_duplicates;
            break;
        case RadianceCache::Stored::Evicting:
            ++m_evictions;
            break;
        }
    }

    Shared& m_shared;
    BatchLattice m_lattice;
    SurfaceCache m_surfaces;               ///< for requests
    std::vector<int32_t> m_requestOf;      ///< by block: the first of its requests; -1: it was in the cache
    std::vector<uint32_t> m_missing;       ///< blocks that are not
    ShadedPointSoA m_points;               ///< of those, on their way
    alignas(64) uint32_t m_bin[kSoAWidth]; ///< and their time bins
    std::vector<Rgb> m_components;         ///< of blocks, one after the other, as the cache has them
    std::vector<Own> m_alone;              ///< the samples that share nothing
    std::vector<Own> m_albedos;            ///< factors of what samples share
    uint64_t m_lookups = 0, m_hits = 0, m_duplicates = 0, m_evictions = 0;
};

class LatticeRender : public IntegratorState {
  public:
    LatticeRender(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : m_shared(scene, settings, seed) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override { return std::make_unique<Worker>(m_shared); }
    void restart(uint64_t seed, int samplesPerPixel) override {
        m_shared.seed = seed;
        if (m_shared.settings.shadesFollowSamples)
            m_shared.settings.shades = samplesPerPixel;
        m_shared.cache.clear();
    }

  private:
    Shared m_shared;
};

} // namespace

std::unique_ptr<IntegratorState> beginLatticeSharing(const Scene& scene, const CacheSettings& settings,
                                                     uint64_t seed) {
    return std::make_unique<LatticeRender>(scene, settings, seed);
}

} // namespace strobe
