#include "core/hash.h"
#include "integrators/batch_lattice.h"
#include "integrators/cache_settings.h"

namespace strobe {

namespace {

/// What the workers of one render share.
struct Shared {
    Shared(const Scene& scene, const CacheSettings& settings, uint64_t seed)
        : scene(scene), settings(settings), seed(seed),
          lattice(scene, settings.blockSize, SurfaceLattice::SmallTriangles::Shared), cache(settings.bytes) {}
    const Scene& scene;
    CacheSettings settings;
    uint64_t seed;
    const SurfaceLattice lattice;
    BlockCache cache;
};

/// Draws the times and places on the lens of points, in time bins `bin`, and what else is random of their
/// requests, from number `at` on; of these, `domain` is the key of the block.
STROBE_LANES void drawShades(uint64_t seed, const CacheSettings& settings, RequestLanes& out, int at,
                             ShadedPointLanes& points, const uint32_t* bin) {
    const int n = points.count;
    const float bins = float(settings.timeBins), shades = float(settings.shades);
    const uint32_t total = uint32_t(settings.shades);
    const LightPart part = settings.indirectOnly ? LightPart::Indirect : LightPart::All;
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        const uint64_t domain = hashOf(seed, out.domain[at + i]);
        const uint64_t random = hashOf(domain, out.index[at + i]), more = mix64(random);
        const float inBin = (float(int32_t(out.index[at + i])) + unitFloat(uint32_t(random >> 32))) / shades;
        points.time[i] = std::min((float(int32_t(bin[i])) + inBin) / bins, kOneMinusEpsilon);
        points.lens.x[i] = unitFloat(uint32_t(more)), points.lens.y[i] = unitFloat(uint32_t(more >> 32));
        out.domain[at + i] = domain, out.total[at + i] = total;
    }
    std::fill_n(out.part + at, n, part);
}

class Worker : public IntegratorWorker {
  public:
    explicit Worker(Shared& shared)
        : m_shared(shared),
          m_lattice(shared.lattice, {shared.settings.timeBins, shared.settings.nearest}, shared.cache),
          m_surfaces(shared.lattice.parts()) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_lattice.begin(batch.samples.size());
        m_alone.clear();
        for (size_t b = 0; b < batch.samples.blocks(); ++b)
            if (allShareOnly(batch, b))
                m_lattice.addAll(batch, b);
            else
                planOneByOne(batch, b, requests);
        m_lattice.finish();
        m_requestOf.clear();
        m_parts.clear();
        m_missing.clear();
        for (const Block& block : m_lattice.blocks())
            lookUp(block, requests.size());
        request(requests);
    }

    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        const std::span<const Block> blocks = m_lattice.blocks();
        for (size_t i = 0; i < blocks.size(); ++i)
            if (m_requestOf[i] >= 0)
                finish(blocks[i], meanFrom(m_requestOf[i], shaded));
        gather(shaded, values);
        return values;
    }

    std::span<const Rgb> resolvePart(const VisibilityBatch&, std::span<const Rgb> shaded,
                                     std::span<Rgb> values, int part) override {
        const std::span<const Block> blocks = m_lattice.blocks();
        for (size_t i = 0; i < blocks.size(); ++i) {
            if (m_requestOf[i] < 0) {
                m_lattice.setValue(blocks[i], m_parts[i * size_t(m_shared.settings.parts) + size_t(part)]);
                continue;
            }
            const Rgb value = meanFrom(m_requestOf[i], shaded);
            m_lattice.setValue(blocks[i], value);
            m_shared.cache.store(keyOfPart(blocks[i].key, part), value);
        }
        gather(shaded, values);
        return values;
    }

    uint64_t blockOf(size_t sample) const override {
        return m_lattice.has(sample) ? m_lattice.mainKeyOf(sample) : 0;
    }

    void report(Counters& counters) const override {
        counters.blockLookups += m_lookups;
        counters.blockHits += m_hits;
        counters.blockDuplicates += m_duplicates;
        counters.blockEvictions += m_evictions;
        counters.cacheBytes = m_shared.cache.bytes();
    }

  private:
    using Block = BatchLattice::Block;
    /// The requests that a sample made for itself; negative: none.
    struct Alone {
        uint32_t sample;
        int32_t own = -1, albedo = -1; ///< albedo: a factor of what it shares
    };

    /// What samples take of their own shades and of the blocks around.
    void gather(std::span<const Rgb> shaded, std::span<Rgb> values) {
        m_lattice.take(values);
        for (const Alone& alone : m_alone) {
            Rgb& value = values[alone.sample];
            if (alone.albedo >= 0)
                value *= shaded[size_t(alone.albedo)];
            if (alone.own >= 0)
                value += shaded[size_t(alone.own)];
        }
    }

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

    /// Whether the samples of the batch's block b share, and have nothing else to ask for.
    bool allShareOnly(const VisibilityBatch& batch, size_t b) const {
        const auto* geometry = batch.samples.block(b).hit.geometry;
        const auto* end = geometry + batch.samples.inBlock(b);
        return m_shared.settings.blockSize > 0 && !m_shared.settings.indirectOnly &&
               std::find(geometry, end, kNone) == end;
    }

    void planOneByOne(const VisibilityBatch& batch, size_t b, ShadingRequests& requests) {
        const bool indirectOnly = m_shared.settings.indirectOnly;
        const uint32_t first = uint32_t(b * kLanes), end = first + uint32_t(batch.samples.inBlock(b));
        for (uint32_t i = first; i < end; ++i) {
            const VisibilitySample sample = batch.samples[i];
            const bool shares = sharesAt(sample.hit);
            const auto ask = [&](LightPart part) {
                ShadingRequest own = requestFor(m_shared.scene, batch, sample);
                own.part = part;
                requests.push_back(own);
                return int32_t(requests.size()) - 1;
            };
            if (!shares || indirectOnly)
                m_alone.push_back({i, ask(shares ? LightPart::Direct : LightPart::All)});
            if (!shares)
                continue;
            if (indirectOnly && materialOf(sample.hit).isTextured())
                m_alone.back().albedo = ask(LightPart::Albedo);
            m_lattice.add(sample, batch.pixels[sample.pixel], i);
        }
    }

    /// Takes the block's value from the cache, or notes that it is missing; its requests will come after
    /// so many.
    void lookUp(const Block& block, size_t requests) {
        ++m_lookups;
        Rgb value;
        const bool found = m_shared.cache.find(block.key, value);
        if (findParts(block.key) && found) {
            ++m_hits;
            m_lattice.setValue(block, value);
            m_requestOf.push_back(-1);
            return;
        }
        const size_t before = m_missing.size() * size_t(m_shared.settings.shades);
        m_missing.push_back(uint32_t(m_requestOf.size()));
        m_requestOf.push_back(int32_t(requests + before));
    }

    /// Appends the parts of a block to m_parts; false if the cache does not have them all.
    bool findParts(uint64_t key) {
        bool all = true;
        for (int part = 0; part < m_shared.settings.parts; ++part)
            all &= m_shared.cache.find(keyOfPart(key, part), m_parts.emplace_back(0));
        return all;
    }
    static uint64_t keyOfPart(uint64_t key, int part) { return hashOf(key, part) | 1; }

    /// Appends the shades of the missing blocks: at random times, one in each of `shades` equal parts of
    /// their time bins, and through random points of the lens.
    void request(ShadingRequests& requests) {
        const size_t shades = size_t(m_shared.settings.shades), end = m_missing.size() * shades;
        for (size_t next = 0; next < end; next += size_t(m_points.count)) {
            const size_t at = requests.size() % kLanes;
            m_points.count = int(std::min(end - next, kLanes - at));
            requests.resize(requests.size() + size_t(m_points.count));
            RequestLanes& out = requests.block(requests.blocks() - 1);
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
    void setRow(const Block& block, uint32_t k, int i, RequestLanes& out, int to) {
        const LatticeFace& face = m_lattice.faceOf(block);
        const LatticePoint& place = m_lattice.placeOf(block);
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
    BatchLattice m_lattice;
    SurfaceParts m_surfaces;            ///< for requests
    std::vector<int32_t> m_requestOf;   ///< by block: the first of its requests; -1: it was in the cache
    std::vector<uint32_t> m_missing;    ///< blocks that are not
    ShadedPointLanes m_points;          ///< of those, on their way
    alignas(64) uint32_t m_bin[kLanes]; ///< and their time bins
    std::vector<Rgb> m_parts;           ///< of blocks, one after the other, as the cache has them
    std::vector<Alone> m_alone;         ///< samples, in order
    uint64_t m_lookups = 0, m_hits = 0, m_duplicates = 0, m_evictions = 0;
};

class LatticeRender : public IntegratorRender {
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

std::unique_ptr<IntegratorRender> beginLatticeSharing(const Scene& scene, const CacheSettings& settings,
                                                      uint64_t seed) {
    return std::make_unique<LatticeRender>(scene, settings, seed);
}

} // namespace strobe
