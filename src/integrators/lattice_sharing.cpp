// Sharing with scope Shared. For each batch:
//
//     samples -> cells -> shading points (BatchLattice) -> lookups in the cache -> requests for the missing
//     ones shaded requests -> values of shading points (and the cache) -> interpolation per sample
#include "core/math/hash.h"
#include "integrators/sharing_settings.h"
#include "lattice/batch_lattice.h"

#include <numeric>

namespace strobe {

namespace {

STROBE_TARGET_CLONES bool anyMissed(const HitSoA& hits, int n) {
    int32_t missed = 0;
    for (int i = 0; i < n; ++i)
        missed |= hits.geometry[i] == kNone;
    return missed;
}

/// Which materials of a scene share shades.
class SharingMaterials {
  public:
    SharingMaterials(const Scene& scene, const SharingSettings& settings) : m_scene(scene) {
        for (const auto& material : scene.materials()) {
            const MaterialFlags& flags = material->flags();
            const bool shares = settings.blockSize > 0 && (!settings.indirectOnly || flags.diffuse);
            m_traits.push_back({shares, flags.textured});
            m_allShare &= shares;
            m_anyTextured |= flags.textured;
        }
    }
    bool allShare() const { return m_allShare; }
    bool anyTextured() const { return m_anyTextured; }
    bool isTextured(const HitSoA& hits, int i) const { return traitsAt(hits, i).isTextured; }
    /// Writes the indices of those of n samples that share, in ascending order. Returns their number.
    int findSharing(const HitSoA& hits, int n, int32_t* indices) const {
        if (m_allShare && !anyMissed(hits, n)) {
            std::iota(indices, indices + n, 0);
            return n;
        }
        int count = 0;
        for (int i = 0; i < n; ++i) {
            indices[count] = i;
            count += hits.geometry[i] != kNone && traitsAt(hits, i).shares;
        }
        return count;
    }

  private:
    struct Traits {
        bool shares, isTextured;
    };
    const Traits& traitsAt(const HitSoA& hits, int i) const {
        return m_traits[size_t(m_scene.geometry({hits.instance[i], hits.geometry[i]}).material)];
    }

    const Scene& m_scene;
    std::vector<Traits> m_traits; ///< by material
    bool m_allShare = true, m_anyTextured = false;
};

/// State that the workers of a render share.
struct LatticeRender {
    LatticeRender(const Scene& scene, const SharingSettings& settings, uint64_t seed)
        : scene(scene), settings(settings), seed(seed),
          lattice(scene, settings.blockSize, SurfaceLattice::SmallTriangles::Shared),
          cache(settings.cacheBytes), materials(scene, settings) {}

    const Scene& scene;
    SharingSettings settings;
    uint64_t seed;
    const SurfaceLattice lattice;
    RadianceCache cache;
    const SharingMaterials materials;
};

/// Returns the key under which the cache holds a component of a shading point's radiance.
uint64_t componentKey(uint64_t key, int component) { return hashOf(key, component) | 1; }

/// The results of looking up a batch's shading points in the cache.
class CacheLookups {
  public:
    struct Counts {
        uint64_t lookups = 0, hits = 0;
    };

    /// Looks up the shading points. The requests of missing ones will be numbered from `firstRequest` on,
    /// `shades` for each. Sets the values of the others.
    void lookUp(const LatticeRender& render, size_t firstRequest, BatchLattice& lattice, Counts& counts) {
        m_firstRequest.clear();
        m_missing.clear();
        m_components.clear();
        const size_t shades = size_t(render.settings.shades);
        const std::span<const ShadingPoint> points = lattice.shadingPoints();
        for (uint32_t i = 0; i < points.size(); ++i) {
            Rgb radiance;
            const bool isCached = render.cache.find(points[i].key, radiance);
            if (lookUpComponents(render, points[i].key) && isCached) {
                lattice.setValue(points[i], radiance);
                m_firstRequest.push_back(kCached);
            } else {
                m_firstRequest.push_back(int32_t(firstRequest + m_missing.size() * shades));
                m_missing.push_back(i);
            }
        }
        counts.lookups += points.size();
        counts.hits += points.size() - m_missing.size();
    }

    /// Indices of the shading points that the cache does not have.
    const std::vector<uint32_t>& missing() const { return m_missing; }
    bool isCached(size_t point) const { return m_firstRequest[point] == kCached; }
    /// The number of the first request of a missing shading point.
    size_t firstRequestOf(size_t point) const { return size_t(m_firstRequest[point]); }
    /// A component of a cached shading point, out of `componentCount`.
    const Rgb& component(size_t point, int component, int componentCount) const {
        return m_components[point * size_t(componentCount) + size_t(component)];
    }

  private:
    /// Appends the components of a shading point; black if the cache does not have them. Returns
    /// whether it has all.
    bool lookUpComponents(const LatticeRender& render, uint64_t key) {
        bool hasAll = true;
        for (int c = 0; c < render.settings.lightComponents; ++c)
            hasAll &= render.cache.find(componentKey(key, c), m_components.emplace_back(0));
        return hasAll;
    }

    static constexpr int32_t kCached = -1;
    std::vector<int32_t> m_firstRequest; ///< by shading point; or kCached
    std::vector<uint32_t> m_missing;
    std::vector<Rgb> m_components; ///< by shading point, then component
};

/// Draws the random numbers of the shades of points in time bins `bin`, and of their requests from number
/// `first` on. Precondition: the `domain` of a request is the key of its shading point, `index` is the number
/// of the shade. Its time is random in one of `shades` equal intervals of the time bin.
STROBE_TARGET_CLONES void drawShades(uint64_t seed, const SharingSettings& settings, const uint32_t* bin,
                                     ShadeSoA& points, RequestSoA& out, int first) {
    const int n = points.count;
    const float bins = float(settings.timeBins), shades = float(settings.shades);
    const uint32_t total = uint32_t(settings.shades);
    const LightComponent component = settings.indirectOnly ? LightComponent::Indirect : LightComponent::All;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const int k = first + i;
        const uint64_t domain = hashOf(seed, out.domain[k]);
        const uint64_t random = hashOf(domain, out.index[k]), lensRandom = mix64(random);
        const float inBin = (float(int32_t(out.index[k])) + unitFloat(uint32_t(random >> 32))) / shades;
        points.time[i] = std::min((float(int32_t(bin[i])) + inBin) / bins, kOneMinusEpsilon);
        points.lens.x[i] = unitFloat(uint32_t(lensRandom));
        points.lens.y[i] = unitFloat(uint32_t(lensRandom >> 32));
        out.domain[k] = domain;
        out.total[k] = total;
    }
    std::fill_n(out.component + first, n, component);
}

/// Appends the requests for the shades of missing shading points, `shades` for each.
void appendRequests(const LatticeRender& render, const BatchLattice& lattice,
                    const std::vector<uint32_t>& missing, SurfaceCache& surfaces, ShadingRequests& requests) {
    const size_t shades = size_t(render.settings.shades), end = missing.size() * shades;
    ShadeSoA points;
    alignas(64) uint32_t bin[kSoAWidth];
    for (size_t next = 0; next < end; next += size_t(points.count)) {
        const int first = int(requests.size() % kSoAWidth);
        points.count = int(std::min(end - next, size_t(kSoAWidth - first)));
        requests.resize(requests.size() + size_t(points.count));
        RequestSoA& out = requests.chunk(requests.chunks() - 1);
        for (int i = 0; i < points.count; ++i) {
            const size_t shade = next + size_t(i), k = shades == 1 ? shade : shade / shades;
            const ShadingPoint& shadingPoint = lattice.shadingPoints()[missing[k]];
            const SurfaceSide& side = lattice.sideOf(shadingPoint);
            const LatticePoint& point = lattice.latticePointOf(shadingPoint);
            points.isVertex[i] = point.isVertex;
            points.hit.set(i, {side.instance, side.geometry, point.prim, point.u, point.v, 0});
            points.isFront[i] = side.isFront;
            bin[i] = lattice.timeBinOf(shadingPoint);
            out.domain[first + i] = shadingPoint.key;
            out.index[first + i] = uint32_t(shade - k * shades);
            out.sample[first + i] = shadingPoint.sample;
        }
        drawShades(render.seed, render.settings, bin, points, out, first);
        render.lattice.writeRequests(points, surfaces, out, first);
    }
}

class LatticeSharingWorker : public IntegratorWorker {
  public:
    explicit LatticeSharingWorker(LatticeRender& render)
        : m_render(render), m_settings(render.settings),
          m_lattice(render.lattice,
                    {m_settings.timeBins, m_settings.nearest, m_settings.lightComponents == 0}, render.cache),
          m_surfaces(render.lattice.makeSurfaceCache()) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_unshared.clear();
        m_albedos.clear();
        m_lattice.begin(batch);
        if (m_settings.indirectOnly)
            requestForEach(m_render.scene, batch, requests);
        for (size_t chunk = 0; chunk < batch.samples.chunks(); ++chunk)
            planChunk(batch, chunk, requests);
        m_lattice.finish();
        m_lookups.lookUp(m_render, requests.size(), m_lattice, m_counts);
        appendRequests(m_render, m_lattice, m_lookups.missing(), m_surfaces, requests);
    }

    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        const std::span<const ShadingPoint> points = m_lattice.shadingPoints();
        const std::vector<uint32_t>& missing = m_lookups.missing();
        constexpr size_t kPrefetchDistance = 8;
        for (size_t k = 0; k < missing.size(); ++k) {
            if (k + kPrefetchDistance < missing.size())
                m_render.cache.prefetch(points[missing[k + kPrefetchDistance]].key);
            const Rgb radiance = meanOfShades(missing[k], shaded);
            m_lattice.setValue(points[missing[k]], radiance);
            count(m_render.cache.store(points[missing[k]].key, radiance));
        }
        resolveSamples(shaded, values);
        return values;
    }

    std::span<const Rgb> resolveComponent(const VisibilityBatch&, std::span<const Rgb> shaded,
                                          std::span<Rgb> values, int component) override {
        const std::span<const ShadingPoint> points = m_lattice.shadingPoints();
        for (size_t i = 0; i < points.size(); ++i) {
            if (m_lookups.isCached(i)) {
                m_lattice.setValue(points[i], m_lookups.component(i, component, m_settings.lightComponents));
            } else {
                const Rgb radiance = meanOfShades(i, shaded);
                m_lattice.setValue(points[i], radiance);
                m_render.cache.store(componentKey(points[i].key, component), radiance);
            }
        }
        resolveSamples(shaded, values);
        return values;
    }

    uint64_t sharingId(size_t sample) const override {
        return m_lattice.contains(sample) ? m_lattice.mainKeyOf(sample) : 0;
    }

    void report(Counters& counters) const override {
        counters.cacheLookups += m_counts.lookups;
        counters.cacheHits += m_counts.hits;
        counters.cacheDuplicates += m_duplicates;
        counters.cacheEvictions += m_evictions;
        counters.cacheBytes = m_render.cache.bytes();
    }

  private:
    /// A request that a sample makes for itself.
    struct OwnRequest {
        uint32_t sample, request;
    };

    /// Adds the samples of a chunk that share to the lattice, and appends the requests that samples make for
    /// themselves.
    void planChunk(const VisibilityBatch& batch, size_t chunk, ShadingRequests& requests) {
        const HitSoA& hits = batch.samples.chunk(chunk).hit;
        const int n = batch.samples.chunkSize(chunk);
        const bool isPatch = m_render.materials.allShare() && m_lattice.addPatch(batch, chunk);
        if (isPatch && !m_settings.indirectOnly)
            return;
        int32_t sharing[kSoAWidth];
        const int count = m_render.materials.findSharing(hits, n, sharing);
        if (m_settings.indirectOnly)
            requestDirect(hits, chunk, {sharing, size_t(count)}, requests);
        else if (count < n)
            requestUnshared(batch, chunk, {sharing, size_t(count)}, requests);
        if (isPatch)
            return;
        if (count == n)
            m_lattice.addChunk(batch, chunk);
        else
            m_lattice.addSamples(batch, chunk, sharing, count);
    }

    /// With `indirectOnly` the first requests are the samples' own. Those of sharing samples become requests
    /// for direct light; appends requests for the albedo where it is textured.
    void requestDirect(const HitSoA& hits, size_t chunk, std::span<const int32_t> sharing,
                       ShadingRequests& requests) {
        for (const int32_t i : sharing)
            requests.chunk(chunk).component[i] = LightComponent::Direct;
        if (!m_render.materials.anyTextured())
            return;
        for (const int32_t i : sharing) {
            if (!m_render.materials.isTextured(hits, i))
                continue;
            const uint32_t sample = uint32_t(chunk * kSoAWidth) + uint32_t(i);
            m_albedos.push_back({sample, uint32_t(requests.size())});
            ShadingRequest albedo = requests[sample];
            albedo.component = LightComponent::Albedo;
            requests.push_back(albedo);
        }
    }

    /// Appends the requests of the samples that do not share.
    void requestUnshared(const VisibilityBatch& batch, size_t chunk, std::span<const int32_t> sharing,
                         ShadingRequests& requests) {
        size_t nextSharing = 0;
        for (int i = 0; i < batch.samples.chunkSize(chunk); ++i) {
            if (nextSharing < sharing.size() && sharing[nextSharing] == i) {
                ++nextSharing;
                continue;
            }
            const uint32_t sample = uint32_t(chunk * kSoAWidth) + uint32_t(i);
            m_unshared.push_back({sample, uint32_t(requests.size())});
            requests.push_back(requestFor(m_render.scene, batch, batch.samples[sample]));
        }
    }

    /// Returns the mean of the shades of a missing shading point.
    Rgb meanOfShades(size_t point, std::span<const Rgb> shaded) const {
        const size_t first = m_lookups.firstRequestOf(point);
        Rgb sum(0);
        for (size_t k = 0; k < size_t(m_settings.shades); ++k)
            sum += shaded[first + k];
        return sum * (1 / float(m_settings.shades));
    }

    /// Writes the radiance of all samples, from the values of the shading points and the samples' own
    /// requests.
    void resolveSamples(std::span<const Rgb> shaded, std::span<Rgb> values) const {
        m_lattice.interpolate(values);
        for (const OwnRequest& albedo : m_albedos)
            values[albedo.sample] *= shaded[albedo.request];
        if (m_settings.indirectOnly)
            for (size_t i = 0; i < values.size(); ++i)
                values[i] += shaded[i];
        for (const OwnRequest& own : m_unshared)
            values[own.sample] = shaded[own.request];
    }

    void count(RadianceCache::StoreResult result) {
        m_duplicates += result == RadianceCache::StoreResult::Duplicate;
        m_evictions += result == RadianceCache::StoreResult::Replaced;
    }

    LatticeRender& m_render;
    const SharingSettings& m_settings;
    // Of the batch:
    BatchLattice m_lattice;
    CacheLookups m_lookups;
    std::vector<OwnRequest> m_unshared; ///< of samples that do not share
    std::vector<OwnRequest> m_albedos;  ///< factors of interpolated light

    SurfaceCache m_surfaces;
    CacheLookups::Counts m_counts;
    uint64_t m_duplicates = 0, m_evictions = 0;
};

class LatticeSharingState : public IntegratorState {
  public:
    LatticeSharingState(const Scene& scene, const SharingSettings& settings, uint64_t seed)
        : m_render(scene, settings, seed) {}
    std::unique_ptr<IntegratorWorker> makeWorker() override {
        return std::make_unique<LatticeSharingWorker>(m_render);
    }
    void restart(uint64_t seed, int samplesPerPixel) override {
        m_render.seed = seed;
        if (m_render.settings.shadesFollowSamples)
            m_render.settings.shades = samplesPerPixel;
        m_render.cache.clear();
    }

  private:
    LatticeRender m_render;
};

} // namespace

std::unique_ptr<IntegratorState> beginLatticeSharing(const Scene& scene, const SharingSettings& settings,
                                                     uint64_t seed) {
    return std::make_unique<LatticeSharingState>(scene, settings, seed);
}

} // namespace strobe
