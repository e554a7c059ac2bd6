#include "integrators/msaa.h"

#include "core/hash.h"

#include <algorithm>
#include <numeric>

namespace strobe {

namespace {

const ParamDef<int> kShades{"shades", 1,
                            "shades per pixel and primitive, drawn from the samples that hit it"};

/// Equal for samples that share: a triangle, or the whole of any other shape. Samples under a negative lobe
/// of the pixel filter keep to themselves, since a group's mean stands for its members only if they weigh the
/// same.
struct GroupId {
    uint32_t instance, geometry, prim;
    bool negative;
    auto operator<=>(const GroupId&) const = default;
};

GroupId groupOf(const VisibilitySample& s) {
    return {s.hit.instance, s.hit.geometry, s.hit.prim, s.weight < 0};
}

class Worker : public IntegratorWorker {
  public:
    Worker(const Scene& scene, int shades) : m_scene(scene), m_shades(uint32_t(shades)) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        m_shares.resize(batch.samples.size());
        const uint32_t spp = batch.slice.count();
        for (size_t first = 0; first < batch.samples.size(); first += spp)
            planPixel(batch, first, spp, requests);
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
    /// Samples that escaped shade for themselves: looking up the surroundings costs nothing worth sharing.
    void planPixel(const VisibilityBatch& batch, size_t first, uint32_t spp, ShadingRequests& requests) {
        m_order.resize(spp);
        std::iota(m_order.begin(), m_order.end(), uint32_t(first));
        std::stable_sort(m_order.begin(), m_order.end(), [&](uint32_t a, uint32_t b) {
            return groupOf(batch.samples[a]) < groupOf(batch.samples[b]);
        });
        for (uint32_t begin = 0; begin < spp;) {
            const VisibilitySample& head = batch.samples[m_order[begin]];
            uint32_t end = begin + 1;
            while (head.hit && end < spp && groupOf(batch.samples[m_order[end]]) == groupOf(head))
                ++end;
            planGroup(batch, begin, end, requests);
            begin = end;
        }
    }

    void planGroup(const VisibilityBatch& batch, uint32_t begin, uint32_t end, ShadingRequests& requests) {
        const auto wanted = [&](uint32_t i) { return batch.wanted.contains(batch.samples[i].index); };
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
    std::vector<uint32_t> m_order;
    std::vector<Share> m_shares;
};

class Msaa : public Integrator {
  public:
    explicit Msaa(const ParamSet& params) : m_shades(params.get(kShades)) {
        if (m_shades < 1)
            throw Error(params.whereIs(kShades), "\"shades\" must be at least 1");
    }
    Dependence dependence() const override { return Dependence::Pixel; }
    std::unique_ptr<IntegratorRender> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedRender<Worker, int>>(scene, m_shades);
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
