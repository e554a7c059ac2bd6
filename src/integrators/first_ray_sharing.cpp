#include "core/math/hash.h"
#include "integrators/cache_settings.h"
#include "lattice/surface_lattice.h"

#include <semaphore>
#include <unordered_map>

namespace strobe {

namespace {

/// A block and what its first rays found. Where they hit is kept in parts of the block's sides.
struct Block {
    Rgb sum{0};
    float x = 0, y = 0; ///< sums, too
    int shades = 0;
    int promised = 0; ///< shades under way

    Rgb value() const { return sum * (1 / float(shades)); }
};

struct AsItIs {
    size_t operator()(uint64_t hash) const { return size_t(hash); }
};
using Blocks = std::unordered_map<uint64_t, Block, AsItIs>;
/// A node of the map: block and key, the next node's address, and its part of the table.
constexpr size_t kBytesPerBlock = sizeof(Blocks::value_type) + 2 * sizeof(void*) + 8;

/// What the workers of one render share: with scope "mutex", the blocks.
struct Shared {
    Shared(const Scene& scene, const CacheSettings& settings)
        : scene(scene), settings(settings),
          lattice(scene, settings.blockSize, SurfaceLattice::SmallTriangles::Apart) {}
    const Scene& scene;
    const CacheSettings settings;
    const SurfaceLattice lattice;
    Blocks blocks;
    /// Held from plan to resolve, while shading: the paper's mutex.
    std::binary_semaphore turn{1};
};

class Worker : public IntegratorWorker {
  public:
    explicit Worker(Shared& shared)
        : m_shared(shared), m_scope(shared.settings.scope),
          m_blocks(m_scope == CacheSettings::Scope::Mutex ? shared.blocks : m_own),
          m_surfaces(shared.lattice.surfaceCache()) {}

    void beginTile() override {
        if (m_scope == CacheSettings::Scope::Tile)
            m_blocks.clear();
    }

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        if (m_scope == CacheSettings::Scope::Mutex)
            m_shared.turn.acquire();
        boundSize();
        m_places.clear();
        m_shading.clear();
        for (const VisibilitySample& sample : batch.samples) {
            if (!sample.hit || !(m_shared.settings.blockSize > 0)) {
                m_places.push_back({0, 0, int64_t(requests.size()), 0, 0, {}});
                requests.push_back(requestFor(m_shared.scene, batch, sample));
                continue;
            }
            const Place place = placeOf(sample);
            Block& block = m_blocks[place.key];
            ++m_lookups;
            if (block.shades + block.promised < m_shared.settings.shades) {
                ++block.promised;
                m_shading.push_back({place.key, uint32_t(requests.size()), place.x, place.y});
                requests.push_back(requestFor(m_shared.scene, batch, sample));
            } else {
                ++m_hits;
            }
            m_places.push_back(place);
        }
    }

    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (const Shading& s : m_shading) {
            Block& block = m_blocks.at(s.key);
            block.sum += shaded[s.request], block.x += s.x, block.y += s.y;
            ++block.shades, --block.promised;
        }
        for (size_t i = 0; i < values.size(); ++i) {
            const Place& place = m_places[i];
            values[i] = place.key ? valueAt(place) : shaded[size_t(place.request)];
        }
        m_peakBytes = std::max(m_peakBytes, m_blocks.size() * kBytesPerBlock);
        if (m_scope == CacheSettings::Scope::Mutex)
            m_shared.turn.release();
        return values;
    }

    uint64_t sharingId(size_t sample) const override { return m_places[sample].key; }

    void report(Counters& counters) const override {
        counters.cacheLookups += m_lookups;
        counters.cacheHits += m_hits;
        counters.cacheEvictions += m_evictions;
        counters.cacheBytes = m_peakBytes;
    }

  private:
    /// Where a sample lies among the blocks of its primitive.
    struct Place {
        uint64_t key; ///< of its block; 0: it shades for itself
        uint64_t primitive;
        int64_t request;
        float x, y; ///< place on the primitive, in blocks
        V2i last;   ///< the primitive's last block, in x and y
    };
    /// A shade that will be added to a block.
    struct Shading {
        uint64_t key;
        uint32_t request;
        float x, y;
    };

    static uint64_t keyOf(uint64_t primitive, int i, int j) { return hashOf(primitive, i, j) | 1; }

    Place placeOf(const VisibilitySample& sample) {
        m_lanes.count = 0;
        m_lanes.add(sample.hit, sample.ray.d, sample.ray.time, m_shared.scene.camera().cone(sample.film));
        m_shared.lattice.locate(m_lanes, m_surfaces);
        const LatticeCell cell = SurfaceLattice::cellAt(m_lanes, 0);
        const int bins = m_shared.settings.timeBins;
        const int bin = std::min(int(sample.ray.time * float(bins)), bins - 1);
        const uint64_t surface = uint64_t(cell.face.instance) << 32 | cell.face.geometry;
        const uint64_t primitive = hashOf(surface, uint64_t(cell.prim) << 1 | cell.face.positive, bin,
                                          uint64_t(cell.nu) << 32 | uint64_t(cell.nv));
        return {keyOf(primitive, int(cell.i), int(cell.j)),
                primitive,
                -1,
                sample.hit.u * cell.nu,
                sample.hit.v * cell.nv,
                {int(cell.nu) - 1, int(cell.nv) - 1}};
    }

    /// The paper: "a weighted interpolation of the surrounding shade regions". Here: of the sample's block
    /// and of those neighbors, among the three that are nearest, that have been shaded, each weighted by how
    /// far its shading point is.
    Rgb valueAt(const Place& place) const {
        const Block& own = m_blocks.at(place.key);
        if (m_shared.settings.nearest)
            return own.value();
        const int i = std::clamp(int(place.x), 0, place.last.x),
                  j = std::clamp(int(place.y), 0, place.last.y);
        const int stepI = place.x - float(i) < 0.5f ? -1 : 1, stepJ = place.y - float(j) < 0.5f ? -1 : 1;
        Rgb sum(0);
        float total = 0;
        const auto take = [&](const Block& block, float least) {
            const float n = 1 / float(block.shades);
            const float dx = std::abs(place.x - block.x * n), dy = std::abs(place.y - block.y * n);
            const float weight = std::max(std::max(1 - dx, 0.f) * std::max(1 - dy, 0.f), least);
            sum += block.sum * (n * weight), total += weight;
        };
        take(own, 1e-3f);
        for (const V2i& step : {V2i(stepI, 0), V2i(0, stepJ), V2i(stepI, stepJ)}) {
            const V2i at = V2i(i, j) + step;
            if (at.x < 0 || at.y < 0 || at.x > place.last.x || at.y > place.last.y)
                continue;
            const auto found = m_blocks.find(keyOf(place.primitive, at.x, at.y));
            if (found != m_blocks.end() && found->second.shades > 0)
                take(found->second, 0);
        }
        return sum * (1 / total);
    }

    /// A cache that has outgrown its bytes starts again, between batches.
    void boundSize() {
        if (m_blocks.size() * kBytesPerBlock <= m_shared.settings.bytes)
            return;
        m_evictions += m_blocks.size();
        Blocks().swap(m_blocks);
    }

    Shared& m_shared;
    const CacheSettings::Scope m_scope;
    Blocks m_own;
    Blocks& m_blocks;
    SurfaceCache m_surfaces;
    LatticeSoA m_lanes;
    std::vector<Place> m_places; ///< one per sample
    std::vector<Shading> m_shading;
    uint64_t m_lookups = 0, m_hits = 0, m_evictions = 0;
    size_t m_peakBytes = 0;
};

class FirstRayRender : public IntegratorState {
  public:
    FirstRayRender(const Scene& scene, const CacheSettings& settings) : m_shared(scene, settings) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override { return std::make_unique<Worker>(m_shared); }
    void restart(uint64_t, int) override { Blocks().swap(m_shared.blocks); }

  private:
    Shared m_shared;
};

} // namespace

std::unique_ptr<IntegratorState> beginFirstRaySharing(const Scene& scene, const CacheSettings& settings) {
    return std::make_unique<FirstRayRender>(scene, settings);
}

} // namespace strobe
