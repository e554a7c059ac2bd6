// Sharing with the paper's scopes: blocks that the first rays shade.
#include "core/math/hash.h"
#include "integrators/sharing_settings.h"
#include "lattice/surface_lattice.h"

#include <semaphore>
#include <unordered_map>

namespace strobe {

namespace {

/// A block of a primitive: sums over its shades.
struct Block {
    Rgb radiance{0};
    float x = 0, y = 0; ///< positions of the shades on the primitive, in blocks
    int shades = 0;
    int pendingShades = 0; ///< requested, and not resolved yet

    Rgb mean() const { return radiance * (1 / float(shades)); }
};

struct IdentityHash {
    size_t operator()(uint64_t hash) const { return size_t(hash); }
};
using BlockMap = std::unordered_map<uint64_t, Block, IdentityHash>;
/// A node of the map (key, block, pointer to the next node and cached hash) and a bucket.
constexpr size_t kBytesPerBlock = sizeof(BlockMap::value_type) + 2 * sizeof(void*) + 8;

/// State that the workers of a render share.
struct FirstRayRender {
    FirstRayRender(const Scene& scene, const SharingSettings& settings)
        : scene(scene), settings(settings),
          lattice(scene, settings.blockSize, SurfaceLattice::SmallTriangles::Apart) {}
    const Scene& scene;
    const SharingSettings settings;
    const SurfaceLattice lattice;
    // Scope Mutex:
    BlockMap blocks;
    /// The paper's mutex, held from plan to resolve, while the batch is shaded: by a semaphore, since another
    /// thread may resolve.
    std::binary_semaphore mutex{1};
};

class FirstRayWorker : public IntegratorWorker {
  public:
    explicit FirstRayWorker(FirstRayRender& render)
        : m_render(render), m_scope(render.settings.scope),
          m_blocks(m_scope == SharingSettings::Scope::Mutex ? render.blocks : m_ownBlocks),
          m_surfaces(render.lattice.makeSurfaceCache()) {}

    void beginTile(const Film&) override {
        if (m_scope == SharingSettings::Scope::Tile)
            m_blocks.clear();
    }

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        if (m_scope == SharingSettings::Scope::Mutex)
            m_render.mutex.acquire();
        clearIfTooLarge();
        m_sources.clear();
        m_pendingShades.clear();
        for (const VisibilitySample& sample : batch.samples) {
            if (!sample.hit || !(m_render.settings.blockSize > 0)) {
                m_sources.push_back({.request = requests.size()});
                requests.push_back(requestFor(m_render.scene, batch, sample));
                continue;
            }
            const Source source = findBlock(sample);
            m_sources.push_back(source);
            Block& block = m_blocks[source.key];
            ++m_lookups;
            if (block.shades + block.pendingShades >= m_render.settings.shades) {
                ++m_hits;
                continue;
            }
            ++block.pendingShades;
            m_pendingShades.push_back({source.key, requests.size(), source.x, source.y});
            requests.push_back(requestFor(m_render.scene, batch, sample));
        }
    }

    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (const PendingShade& shade : m_pendingShades) {
            Block& block = m_blocks.at(shade.key);
            block.radiance += shaded[shade.request];
            block.x += shade.x;
            block.y += shade.y;
            ++block.shades;
            --block.pendingShades;
        }
        for (size_t i = 0; i < values.size(); ++i) {
            const Source& source = m_sources[i];
            values[i] = source.key ? interpolate(source) : shaded[source.request];
        }
        m_peakBytes = std::max(m_peakBytes, m_blocks.size() * kBytesPerBlock);
        if (m_scope == SharingSettings::Scope::Mutex)
            m_render.mutex.release();
        return values;
    }

    uint64_t sharingId(size_t sample) const override { return m_sources[sample].key; }

    void report(Counters& counters) const override {
        counters.cacheLookups += m_lookups;
        counters.cacheHits += m_hits;
        counters.cacheEvictions += m_evictions;
        counters.cacheBytes = m_peakBytes;
    }

  private:
    /// A sample's block, or its own request.
    struct Source {
        uint64_t key = 0; ///< of the block; 0: the sample has a request of its own
        size_t request = 0;
        uint64_t primitive = 0; ///< the part of the key that all blocks of the primitive have
        float x = 0, y = 0;     ///< position on the primitive, in blocks
        V2i lastBlock{0};       ///< of the primitive, in x and y
    };
    /// A requested shade that will be added to a block.
    struct PendingShade {
        uint64_t key;
        size_t request;
        float x, y;
    };

    static uint64_t keyOf(uint64_t primitive, int i, int j) { return hashOf(primitive, i, j) | 1; }

    Source findBlock(const VisibilitySample& sample) {
        m_hitSoA.count = 0;
        m_hitSoA.push_back(sample.hit, sample.ray.d, sample.ray.time,
                           m_render.scene.camera().cone(sample.film));
        m_render.lattice.locate(m_hitSoA, m_surfaces);
        const LatticeCell cell = SurfaceLattice::cellOf(m_hitSoA, 0);
        const int bins = m_render.settings.timeBins;
        const int bin = std::min(int(sample.ray.time * float(bins)), bins - 1);
        const uint64_t surface = uint64_t(cell.side.instance) << 32 | cell.side.geometry;
        Source source;
        source.primitive = hashOf(surface, uint64_t(cell.prim) << 1 | cell.side.isFront, bin,
                                  uint64_t(cell.nu) << 32 | uint64_t(cell.nv));
        source.key = keyOf(source.primitive, int(cell.i), int(cell.j));
        source.x = sample.hit.u * cell.nu;
        source.y = sample.hit.v * cell.nv;
        source.lastBlock = {int(cell.nu) - 1, int(cell.nv) - 1};
        return source;
    }

    /// The paper: "a weighted interpolation of the surrounding shade regions". Here: of the sample's block
    /// and of the three nearest neighbors that are shaded, weighted by the distance of their mean shading
    /// positions.
    Rgb interpolate(const Source& source) const {
        const Block& own = m_blocks.at(source.key);
        if (m_render.settings.nearest)
            return own.mean();
        Rgb sum(0);
        float weightSum = 0;
        const auto add = [&](const Block& block, float minWeight) {
            const float n = 1 / float(block.shades);
            const float dx = std::abs(source.x - block.x * n), dy = std::abs(source.y - block.y * n);
            const float weight = std::max(std::max(1 - dx, 0.f) * std::max(1 - dy, 0.f), minWeight);
            sum += block.radiance * (n * weight);
            weightSum += weight;
        };
        add(own, 1e-3f);
        const int i = std::clamp(int(source.x), 0, source.lastBlock.x);
        const int j = std::clamp(int(source.y), 0, source.lastBlock.y);
        const int stepI = source.x - float(i) < 0.5f ? -1 : 1, stepJ = source.y - float(j) < 0.5f ? -1 : 1;
        for (const V2i& step : {V2i(stepI, 0), V2i(0, stepJ), V2i(stepI, stepJ)}) {
            const V2i neighbor = V2i(i, j) + step;
            if (neighbor.x < 0 || neighbor.y < 0 || neighbor.x > source.lastBlock.x ||
                neighbor.y > source.lastBlock.y)
                continue;
            const auto found = m_blocks.find(keyOf(source.primitive, neighbor.x, neighbor.y));
            if (found != m_blocks.end() && found->second.shades > 0)
                add(found->second, 0);
        }
        return sum * (1 / weightSum);
    }

    /// Removes all blocks if they exceed the size of the cache; between batches, when no shade is pending.
    void clearIfTooLarge() {
        if (m_blocks.size() * kBytesPerBlock <= m_render.settings.cacheBytes)
            return;
        m_evictions += m_blocks.size();
        BlockMap().swap(m_blocks);
    }

    FirstRayRender& m_render;
    const SharingSettings::Scope m_scope;
    BlockMap m_ownBlocks;
    BlockMap& m_blocks;
    SurfaceCache m_surfaces;
    LatticeHitSoA m_hitSoA;
    // Of the batch:
    std::vector<Source> m_sources; ///< by sample
    std::vector<PendingShade> m_pendingShades;

    uint64_t m_lookups = 0, m_hits = 0, m_evictions = 0;
    size_t m_peakBytes = 0;
};

class FirstRaySharingState : public IntegratorState {
  public:
    FirstRaySharingState(const Scene& scene, const SharingSettings& settings) : m_render(scene, settings) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<FirstRayWorker>(m_render);
    }
    void restart(uint64_t, int) override { BlockMap().swap(m_render.blocks); }

  private:
    FirstRayRender m_render;
};

} // namespace

std::unique_ptr<IntegratorState> beginFirstRaySharing(const Scene& scene, const SharingSettings& settings) {
    return std::make_unique<FirstRaySharingState>(scene, settings);
}

} // namespace strobe
