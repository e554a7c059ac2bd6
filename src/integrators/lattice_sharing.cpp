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
    CacheSettings settings;
    uint64_t seed;
    const SurfaceLattice lattice;
    BlockCache cache;
};

class Worker : public IntegratorWorker {
  public:
    explicit Worker(Shared& shared)
        : m_shared(shared),
          m_binBits(std::min(int(std::bit_width(uint32_t(shared.settings.timeBins - 1))), kMostBinBits)) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        clear(batch.samples.size());
        const bool indirectOnly = m_shared.settings.indirectOnly;
        uint32_t pixel = ~0u;
        RayCone cone;
        for (const VisibilitySample& sample : batch.samples) {
            if (sample.pixel != pixel) {
                pixel = sample.pixel;
                cone = m_shared.lattice.coneOf(batch.pixels[pixel]);
            }
            const bool shares = sharesAt(sample.hit);
            const auto ask = [&](LightPart part) {
                ShadingRequest own = requestFor(m_shared.scene, batch, sample);
                own.part = part;
                requests.push_back(own);
                return int32_t(requests.size()) - 1;
            };
            const uint32_t index = batch.placeOf(sample.pixel, sample.index);
            if (!shares || indirectOnly)
                m_alone[index].own = ask(shares ? LightPart::Direct : LightPart::All);
            if (!shares)
                continue;
            if (indirectOnly && materialOf(sample.hit).isTextured())
                m_alone[index].albedo = ask(LightPart::Albedo);
            m_queries[m_queryCount] = {sample, cone};
            m_sampleOf[m_queryCount++] = index;
            if (m_queryCount == kLanes)
                planShared();
        }
        planShared();
        for (Block& block : m_blocks)
            lookUp(block, requests);
    }

    void resolve(const VisibilityBatch&, std::span<const Rgb> shaded, std::span<Rgb> values) override {
        for (const Block& block : m_blocks)
            if (block.request >= 0)
                finish(block, shaded);
        gather(shaded, values);
    }

    void resolvePart(const VisibilityBatch&, std::span<const Rgb> shaded, std::span<Rgb> values,
                     int part) override {
        for (size_t i = 0; i < m_blocks.size(); ++i) {
            const Block& block = m_blocks[i];
            if (block.request < 0) {
                setValue(block, m_parts[i * size_t(m_shared.settings.parts) + size_t(part)]);
                continue;
            }
            const Rgb value = meanOf(block, shaded);
            setValue(block, value);
            m_shared.cache.store(keyOfPart(block.key, part), value);
        }
        gather(shaded, values);
    }

    uint64_t blockOf(size_t sample) const override {
        const Share& share = m_shares[sample];
        if (share.cell == kNone)
            return 0;
        const Cell& cell = m_cells[share.cell >> m_binBits];
        const Point& point = m_points[cell.point[m_shared.settings.nearest ? nearestOf(cell, share.place)
                                                                           : heaviestOf(cell, share.place)]];
        return SurfaceLattice::keyOf(point.at, binOf(point, slotOf(share)));
    }

    void report(Counters& counters) const override {
        counters.blockLookups += m_lookups;
        counters.blockHits += m_hits;
        counters.blockDuplicates += m_duplicates;
        counters.blockEvictions += m_evictions;
        counters.cacheBytes = m_shared.cache.bytes();
    }

  private:
    /// Time bins come in eras of a few, so that cells and points are found once for all bins of an era. A
    /// bin's number in its era is its slot.
    static constexpr int kMostBinBits = 3;
    static constexpr int kPoints = LatticeCell::kPoints;
    /// A point of the batch in an era.
    struct Point {
        LatticeFace face;
        LatticePoint at;
        uint32_t era;
        uint32_t asked; ///< bits of slots: those that are among the blocks
    };
    /// A cell of the batch in an era.
    struct Cell {
        LatticeCell::Kind kind;
        uint8_t asked;           ///< bits of slots: those whose points are
        uint32_t point[kPoints]; ///< 0: there is none
    };
    /// A point at a slot.
    struct Block {
        uint64_t key;
        uint32_t point, slot;
        uint32_t sample; ///< the first to ask for it
        int32_t request; ///< the first of its requests; -1: it was in the cache
    };
    /// A block's radiance, or the part of it at hand; all zero where there is no point.
    struct alignas(16) Value {
        float numbers[4]{}; ///< red, green, blue, weight
    };
    /// What a sample takes from a cell.
    struct Share {
        V3f place;     ///< in the cell
        uint32_t cell; ///< and the slot; kNone: it shares nothing
    };
    /// The requests that a sample made for itself; negative: none.
    struct Alone {
        int32_t own = -1, albedo = -1; ///< albedo: a factor of what it shares
    };

    void clear(size_t samples) {
        m_blocks.clear();
        m_parts.clear();
        m_cells.clear();
        m_points.assign(1, Point{}); // the one that is missing
        m_values.assign(size_t(1) << m_binBits, Value{});
        m_shares.assign(samples, {V3f(0), kNone});
        m_alone.assign(samples, {});
        m_pointTable.clear();
        m_cellTable.clear();
    }

    /// What samples take of their own shades and of the blocks around.
    void gather(std::span<const Rgb> shaded, std::span<Rgb> values) {
        for (size_t i = 0; i < values.size(); ++i) {
            const Alone& alone = m_alone[i];
            values[i] = alone.own >= 0 ? shaded[size_t(alone.own)] : Rgb(0);
            if (m_shares[i].cell == kNone)
                continue;
            const Rgb shared = valueOf(m_shares[i]);
            values[i] += alone.albedo >= 0 ? shared * shaded[size_t(alone.albedo)] : shared;
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

    /// Finds the cells of the queries, and asks for their points.
    void planShared() {
        const std::span<const LatticeQuery> queries(m_queries, size_t(m_queryCount));
        m_queryCount = 0;
        m_shared.lattice.locate(queries, m_lanes);
        const int bins = m_shared.settings.timeBins;
        const uint32_t slots = (1u << m_binBits) - 1;
        for (int i = 0; i < m_lanes.count; ++i) {
            const float time = queries[size_t(i)].time;
            const uint32_t bin = uint32_t(std::min(int(time * float(bins)), bins - 1));
            const uint32_t era = bin >> m_binBits, slot = bin & slots;
            const uint32_t next = uint32_t(m_cells.size());
            const uint32_t c = m_cellTable.insert(quickSum<4>(m_lanes.key[i], era), next);
            if (c == next)
                m_cells.push_back(makeCell(SurfaceLattice::cellAt(queries, m_lanes, i), era));
            Cell& cell = m_cells[c];
            const V3f place = m_lanes.place.at(i);
            m_shares[m_sampleOf[i]] = {place, c << m_binBits | slot};
            if (m_shared.settings.nearest) {
                ask(cell.point[nearestOf(cell, place)], slot, m_sampleOf[i]);
            } else if (!(cell.asked >> slot & 1)) {
                cell.asked |= uint8_t(1u << slot);
                for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
                    if (cell.point[k])
                        ask(cell.point[k], slot, m_sampleOf[i]);
            }
        }
    }

    Cell makeCell(const LatticeCell& cell, uint32_t era) {
        LatticePoint points[kPoints];
        m_shared.lattice.points(cell, points);
        Cell made{cell.kind, 0, {}};
        for (int k = 0; k < cell.count(); ++k)
            if (points[k])
                made.point[k] = pointAt(cell.face, points[k], era);
        return made;
    }

    uint32_t pointAt(const LatticeFace& face, const LatticePoint& at, uint32_t era) {
        const uint64_t key = SurfaceLattice::keyOf(at, era << m_binBits);
        const uint32_t next = uint32_t(m_points.size()), index = m_pointTable.insert(key, next);
        if (index == next) {
            m_points.push_back({face, at, era, 0});
            m_values.resize(m_points.size() << m_binBits);
        }
        return index;
    }

    uint32_t binOf(const Point& point, uint32_t slot) const { return point.era << m_binBits | slot; }
    uint32_t slotOf(const Share& share) const { return share.cell & ((1u << m_binBits) - 1); }
    Value& valueAt(uint32_t point, uint32_t slot) { return m_values[point << m_binBits | slot]; }

    /// Files the block of a point; it is looked up later, when the cache's memory has arrived.
    void ask(uint32_t index, uint32_t slot, uint32_t sample) {
        Point& point = m_points[index];
        if (point.asked >> slot & 1)
            return;
        point.asked |= 1u << slot;
        const uint64_t key = SurfaceLattice::keyOf(point.at, binOf(point, slot));
        m_shared.cache.prefetch(key);
        m_blocks.push_back({key, index, slot, sample, -1});
    }

    /// Of a cell's points, that with the greatest weight.
    static int heaviestOf(const Cell& cell, const V3f& place, bool orMissing = false) {
        float weights[kPoints];
        LatticeCell::weigh(cell.kind, place, weights);
        int best = 0;
        float most = -1;
        for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
            if ((cell.point[k] || orMissing) && weights[k] > most)
                best = k, most = weights[k];
        return best;
    }

    /// Of a cell's points, the nearest; if it is missing, of the others, which are a grid cell's, the one
    /// fewest edges away.
    static int nearestOf(const Cell& cell, const V3f& place) {
        const int wanted = heaviestOf(cell, place, true);
        int best = wanted, fewest = cell.point[wanted] ? 0 : kPoints;
        for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
            if (const int edges = std::popcount(unsigned(k ^ wanted)); cell.point[k] && edges < fewest)
                best = k, fewest = edges;
        return best;
    }

    void lookUp(Block& block, ShadingRequests& requests) {
        ++m_lookups;
        Rgb value;
        const bool found = m_shared.cache.find(block.key, value);
        if (findParts(block.key) && found) {
            ++m_hits;
            setValue(block, value);
            return;
        }
        block.request = int32_t(requests.size());
        request(block, requests);
    }

    /// Appends the parts of a block to m_parts; false if the cache does not have them all.
    bool findParts(uint64_t key) {
        bool all = true;
        for (int part = 0; part < m_shared.settings.parts; ++part)
            all &= m_shared.cache.find(keyOfPart(key, part), m_parts.emplace_back(0));
        return all;
    }
    static uint64_t keyOfPart(uint64_t key, int part) { return hashOf(key, part) | 1; }

    /// The shades of a block: at random times, one in each of `shades` equal parts of its time bin, and
    /// through random points of the lens.
    void request(const Block& block, ShadingRequests& requests) const {
        const CacheSettings& settings = m_shared.settings;
        const Point& point = m_points[block.point];
        const uint64_t domain = hashOf(m_shared.seed, block.key);
        for (int k = 0; k < settings.shades; ++k) {
            const uint64_t random = hashOf(domain, k), more = mix64(random);
            const float inBin = (float(k) + unitFloat(uint32_t(random >> 32))) / float(settings.shades);
            const float time = (float(binOf(point, block.slot)) + inBin) / float(settings.timeBins);
            ShadingRequest r =
                m_shared.lattice.request(point.face, point.at, std::min(time, kOneMinusEpsilon),
                                         V2f(unitFloat(uint32_t(more)), unitFloat(uint32_t(more >> 32))));
            r.domain = domain;
            r.index = uint32_t(k);
            r.total = uint32_t(settings.shades);
            r.sample = block.sample;
            r.part = settings.indirectOnly ? LightPart::Indirect : LightPart::All;
            requests.push_back(r);
        }
    }

    Rgb meanOf(const Block& block, std::span<const Rgb> shaded) const {
        Rgb sum(0);
        for (int k = 0; k < m_shared.settings.shades; ++k)
            sum += shaded[size_t(block.request + k)];
        return sum * (1 / float(m_shared.settings.shades));
    }

    void setValue(const Block& block, const Rgb& value) {
        valueAt(block.point, block.slot) = {{value.x, value.y, value.z, 1}};
    }

    void finish(const Block& block, std::span<const Rgb> shaded) {
        const Rgb value = meanOf(block, shaded);
        setValue(block, value);
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

    Rgb valueOf(const Share& share) const {
        const Cell& cell = m_cells[share.cell >> m_binBits];
        const Value* values = &m_values[slotOf(share)];
        if (m_shared.settings.nearest) {
            const float* v = values[cell.point[nearestOf(cell, share.place)] << m_binBits].numbers;
            return {v[0], v[1], v[2]};
        }
        float weights[kPoints];
        LatticeCell::weigh(cell.kind, share.place, weights);
        Value sum;
        for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k) {
            const Value& v = values[cell.point[k] << m_binBits];
            for (int c = 0; c < 4; ++c)
                sum.numbers[c] += v.numbers[c] * weights[k];
        }
        const float scale = 1 / sum.numbers[3];
        return {sum.numbers[0] * scale, sum.numbers[1] * scale, sum.numbers[2] * scale};
    }

    Shared& m_shared;
    const int m_binBits; ///< of a slot
    std::vector<Point> m_points;
    std::vector<Value> m_values; ///< by point, then slot
    std::vector<Cell> m_cells;
    std::vector<Block> m_blocks;
    std::vector<Rgb> m_parts;    ///< of m_blocks, one after the other, as the cache has them
    std::vector<Share> m_shares; ///< by sample
    std::vector<Alone> m_alone;  ///< by sample
    SlotTable m_pointTable, m_cellTable;
    uint64_t m_lookups = 0, m_hits = 0, m_duplicates = 0, m_evictions = 0;

    // Samples on their way into the lattice:
    int m_queryCount = 0;
    LatticeQuery m_queries[kLanes];
    uint32_t m_sampleOf[kLanes];
    LatticeLanes m_lanes;
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
