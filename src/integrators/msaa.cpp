#include "integrators/msaa.h"

#include "core/math/hash.h"
#include "core/params/plugin.h"
#include "core/render/batch.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace strobe {

namespace {

const ParamDef<int> kShades{"shades", 1, "shades per pixel and primitive, of samples chosen at random",
                            nullptr, kAtLeastOne};

/// Writes a key for each sample of a chunk. Samples of a pixel with equal keys are a group: those that hit
/// the same primitive with the same sign of the filter weight, since a group's mean can replace its members
/// only if they have equal weights. A sample that missed is a group of its own, because looking up the
/// background is cheap.
STROBE_TARGET_CLONES void computeGroupKeys(const VisibilitySoA& samples, uint64_t* keys) {
    STROBE_IVDEP
    for (int i = 0; i < kSoAWidth; ++i) {
        const uint64_t geometry = uint64_t(samples.hit.instance[i]) << 32 | samples.hit.geometry[i];
        const uint32_t prim = samples.hit.geometry[i] == kNone ? samples.index[i] : samples.hit.prim[i];
        const uint32_t isNegative = std::bit_cast<uint32_t>(samples.weight[i]) >> 31;
        keys[i] = fastHashOf(geometry, uint64_t(prim) << 1 | isNegative);
    }
}

/// Numbers the keys of a pixel's samples: a hash table.
class GroupTable {
  public:
    /// Removes all groups. At most `maxGroups` may be added then.
    void reset(uint32_t maxGroups) {
        m_slots.assign(std::bit_ceil(2 * size_t(maxGroups)), kNone);
        m_keys.clear();
    }
    /// Returns the group of a key. New groups are numbered consecutively.
    uint32_t findOrAdd(uint64_t key) {
        const size_t mask = m_slots.size() - 1;
        size_t i = key & mask;
        while (m_slots[i] != kNone && m_keys[m_slots[i]] != key)
            i = (i + 1) & mask;
        if (m_slots[i] == kNone) {
            m_slots[i] = uint32_t(m_keys.size());
            m_keys.push_back(key);
        }
        return m_slots[i];
    }

  private:
    std::vector<uint32_t> m_slots; ///< a group or kNone
    std::vector<uint64_t> m_keys;  ///< by group
};

/// Maps each group to `shades` requests, or to fewer if it has fewer samples.
class MsaaWorker : public IntegratorWorker {
  public:
    MsaaWorker(const Scene& scene, int shades) : m_scene(scene), m_shades(uint32_t(shades)) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_requests.resize(batch.samples.size());
        m_keys.resize(batch.samples.chunks() * kSoAWidth);
        for (size_t c = 0; c < batch.samples.chunks(); ++c)
            computeGroupKeys(batch.samples.chunk(c), &m_keys[c * kSoAWidth]);
        const uint32_t samplesPerPixel = batch.slice.count();
        for (uint32_t first = 0; first < batch.samples.size(); first += samplesPerPixel)
            planPixel(batch, first, samplesPerPixel, requests);
    }

    /// A sample's radiance is the mean of its group's requests.
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override {
        for (size_t i = 0; i < values.size(); ++i) {
            const RequestRange& range = m_requests[i];
            Rgb sum(0);
            for (uint32_t k = 0; k < range.count; ++k)
                sum += shaded[range.first + k];
            values[i] = range.count <= 1 ? sum : sum * (1 / float(range.count));
        }
        return values;
    }

  private:
    struct RequestRange {
        uint32_t first, count; ///< count 0: the values of the group are not wanted
    };

    /// Sorts the samples of a pixel by group: a counting sort.
    void planPixel(const VisibilityBatch& batch, uint32_t first, uint32_t count, ShadingRequests& requests) {
        m_groups.reset(count);
        m_groupOf.resize(count);
        m_groupEnds.clear();
        for (uint32_t i = 0; i < count; ++i) {
            const uint32_t group = m_groups.findOrAdd(m_keys[first + i]);
            if (group == m_groupEnds.size())
                m_groupEnds.push_back(0);
            m_groupOf[i] = group;
            ++m_groupEnds[group];
        }
        std::exclusive_scan(m_groupEnds.begin(), m_groupEnds.end(), m_groupEnds.begin(), 0u);
        m_sorted.resize(count);
        for (uint32_t i = 0; i < count; ++i)
            m_sorted[m_groupEnds[m_groupOf[i]]++] = first + i;
        uint32_t begin = 0;
        for (const uint32_t end : m_groupEnds) {
            planGroup(batch, {&m_sorted[begin], end - begin}, requests);
            begin = end;
        }
    }

    /// Requests shades for samples of the group, chosen uniformly without repetition. The choice depends on
    /// the pixel and the index of the group's first sample only. Reorders the group.
    void planGroup(const VisibilityBatch& batch, std::span<uint32_t> group, ShadingRequests& requests) {
        const bool isWanted = std::any_of(group.begin(), group.end(), [&](uint32_t sample) {
            return batch.filmSlice.contains(batch.samples[sample].index);
        });
        const uint32_t size = uint32_t(group.size()), count = isWanted ? std::min(size, m_shades) : 0;
        for (const uint32_t sample : group)
            m_requests[sample] = {uint32_t(requests.size()), count};
        const VisibilitySample head = batch.samples[group[0]];
        uint64_t random = hashOf(batch.pixels[head.pixel].domain, head.index, 0x6d736161u);
        for (uint32_t k = 0; k < count; ++k) { // the first steps of a Fisher-Yates shuffle
            random = mix64(random);
            const uint32_t pick = k + uint32_t((random >> 32) * (size - k) >> 32);
            std::swap(group[k], group[pick]);
            requests.push_back(requestFor(m_scene, batch, batch.samples[group[k]]));
        }
    }

    const Scene& m_scene;
    const uint32_t m_shades;
    std::vector<uint64_t> m_keys;         ///< by sample of the batch
    std::vector<RequestRange> m_requests; ///< by sample of the batch
    // Of a pixel:
    GroupTable m_groups;
    std::vector<uint32_t> m_groupOf;   ///< by sample of the pixel
    std::vector<uint32_t> m_sorted;    ///< samples of the batch, group by group
    std::vector<uint32_t> m_groupEnds; ///< in m_sorted, by group
};

class Msaa : public Integrator {
  public:
    explicit Msaa(const ParamSet& params) : m_shades(params.get(kShades)) {}
    BiasBound biasBound(const Scene&) const override { return {}; }
    SampleDependence dependence() const override { return SampleDependence::Pixel; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<MsaaWorker, int>>(scene, m_shades);
    }

  private:
    int m_shades;
};

} // namespace

IntegratorPlugin msaaPlugin() {
    return {"msaa",
            "samples of a pixel that hit the same primitive share a shade; unbiased",
            {kShades},
            [](const ParamSet& params, const BuildContext&) { return std::make_shared<const Msaa>(params); }};
}

} // namespace strobe
