#include "integrators/msaa.h"

#include "core/math/hash.h"
#include "lattice/index_table.h"

#include <algorithm>
#include <bit>

namespace strobe {

namespace {

const ParamDef<int> kShades{"shades", 1, "shades per pixel and primitive, drawn from the samples that hit it",
                            nullptr, kAtLeastOne};

/// Equal for samples that share: those that hit the same triangle, or any other shape. Samples under a
/// negative lobe of the pixel filter keep to themselves, since a group's mean stands for its members only if
/// they weigh the same.
STROBE_TARGET_CLONES void findGroupKeys(const VisibilitySoA& samples, uint64_t* keys) {
    STROBE_IVDEP
    for (int i = 0; i < kSoAWidth; ++i)
        keys[i] = quickHashOf(uint64_t(samples.hit.instance[i]) << 32 | samples.hit.geometry[i],
                              uint64_t(samples.hit.prim[i]) << 1 |
                                  std::bit_cast<uint32_t>(samples.weight[i]) >> 31);
}

class Worker : public IntegratorWorker {
  public:
    Worker(const Scene& scene, int shades) : m_scene(scene), m_shades(uint32_t(shades)) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_shares.resize(batch.samples.size());
        m_keys.resize(batch.samples.chunks() * kSoAWidth);
        for (size_t b = 0; b < batch.samples.chunks(); ++b)
            findGroupKeys(batch.samples.chunk(b), &m_keys[b * kSoAWidth]);
        const uint32_t spp = batch.slice.count();
        m_groupOf.resize(spp), m_order.resize(spp), m_ends.resize(spp);
        for (size_t first = 0; first < batch.samples.size(); first += spp)
            planPixel(batch, uint32_t(first), spp, requests);
    }

    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i) {
            const Share& share = m_shares[i];
            Rgb sum(0);
            for (uint32_t k = 0; k < share.count; ++k)
                sum += shaded[share.first + k];
            values[i] = share.count <= 1 ? sum : sum * (1 / float(share.count));
        }
        return values;
    }

  private:
    /// The requests whose mean a sample takes; none if its value is not wanted.
    struct Share {
        uint32_t first, count;
    };

    /// Groups the pixel's samples by primitive and draws the shades of each group uniformly, without repeats.
    /// Samples that missed shade for themselves: looking up the surroundings costs nothing worth sharing.
    void planPixel(const VisibilityBatch& batch, uint32_t first, uint32_t spp, ShadingRequests& requests) {
        const uint32_t groups = findGroups(batch, first, spp);
        for (uint32_t group = 0, end = 0; group < groups; ++group) {
            const uint32_t size = m_ends[group];
            m_ends[group] = end, end += size;
        }
        for (uint32_t i = 0; i < spp; ++i)
            m_order[m_ends[m_groupOf[i]]++] = first + i;
        for (uint32_t group = 0, begin = 0; group < groups; begin = m_ends[group++])
            planGroup(batch, begin, m_ends[group], requests);
    }

    /// Numbers the groups, in the order of their first samples: m_groupOf each sample. Returns how many there
    /// are; their sizes are in m_ends.
    uint32_t findGroups(const VisibilityBatch& batch, uint32_t first, uint32_t spp) {
        m_table.clear();
        uint32_t groups = 0;
        for (uint32_t i = 0; i < spp; ++i) {
            const uint32_t at = first + i;
            const bool missed = batch.samples.chunk(at / kSoAWidth).hit.geometry[at % kSoAWidth] == kNone;
            const uint32_t group = missed ? groups : m_table.insert(m_keys[at], groups);
            if (group == groups)
                m_ends[groups++] = 0;
            m_groupOf[i] = group, ++m_ends[group];
        }
        return groups;
    }

    void planGroup(const VisibilityBatch& batch, uint32_t begin, uint32_t end, ShadingRequests& requests) {
        const auto wanted = [&](uint32_t i) { return batch.filmSlice.contains(batch.samples[i].index); };
        const bool any = std::any_of(&m_order[begin], &m_order[end - 1] + 1, wanted);
        const uint32_t size = end - begin, count = any ? std::min(size, m_shades) : 0;
        const Share share{uint32_t(requests.size()), count};
        for (uint32_t i = begin; i < end; ++i)
            m_shares[m_order[i]] = share;
        // A partial Fisher-Yates shuffle: a function of the pixel and the group's first sample alone.
        const VisibilitySample& head = batch.samples[m_order[begin]];
        uint64_t h = hashOf(batch.pixels[head.pixel].domain, head.index, 0x6d736161u);
        for (uint32_t k = 0; k < count; ++k) {
            h = mix64(h);
            const uint32_t pick = k + uint32_t((h >> 32) * (size - k) >> 32);
            std::swap(m_order[begin + k], m_order[begin + pick]);
            requests.push_back(requestFor(m_scene, batch, batch.samples[m_order[begin + k]]));
        }
    }

    const Scene& m_scene;
    const uint32_t m_shades;
    std::vector<uint64_t> m_keys; ///< by sample of the batch
    IndexTable m_table;
    // Of a pixel's samples:
    std::vector<uint32_t> m_groupOf;
    std::vector<uint32_t> m_order; ///< group by group, samples of the batch
    std::vector<uint32_t> m_ends;  ///< of groups in m_order
    std::vector<Share> m_shares;
};

class Msaa : public Integrator {
  public:
    explicit Msaa(const ParamSet& params) : m_shades(params.get(kShades)) {}
    BiasBound biasBound(const Scene&) const override { return {}; }
    SampleDependence dependence() const override { return SampleDependence::Pixel; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<Worker, int>>(scene, m_shades);
    }

  private:
    int m_shades;
};

} // namespace

IntegratorPlugin msaaPlugin() {
    return {"msaa",
            "samples of one pixel that hit the same primitive share a shade; unbiased",
            {kShades},
            [](const ParamSet& params, const BuildContext&) { return std::make_shared<const Msaa>(params); }};
}

} // namespace strobe
