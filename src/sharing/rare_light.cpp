#include "sharing/rare_light.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <iterator>

namespace strobe {

namespace {

/// Regions have as much light as this number of equally bright samples.
constexpr float kEnoughSamples = 8;
/// Samples are half rare if a pixel has this number of equally bright ones.
constexpr float kHalfRare = 0.2f;

/// Returns the fraction of light that is rare where a pixel has this number of equally bright samples.
float rarityOf(float countPerPixel) {
    constexpr float kLeast = 0.05f; // less is 0
    return std::max(1 / (1 + sqr(countPerPixel / kHalfRare)) - kLeast, 0.f) / (1 - kLeast);
}

/// A cell whose regions are sought.
struct Query {
    uint32_t cell, node;
    float rest[kParts] = {1, 1}; ///< the weight that smaller regions left
};

} // namespace

/// The nodes of the size of one node around it, and what they hold.
class RareLight::Surroundings {
  public:
    explicit Surroundings(const RareLight& light) : m_light(light) {}
    /// Collects the nodes around a node.
    void collect(uint32_t node) {
        if (m_node == node)
            return;
        m_node = node;
        m_p.clear();
        m_n.clear();
        m_regions.clear();
        const CellPyramid& pyramid = m_light.m_pyramid;
        pyramid.forNeighbors(pyramid.nodes()[node], [&](uint32_t index) {
            const CellNode& at = pyramid.nodes()[index];
            const Sums* sums = &m_light.m_sums[kParts * index];
            m_p.push_back(at.p);
            m_n.push_back(at.n);
            m_regions.push_back({{sums[0], sums[1]}, at.count[0] + at.count[1]});
        });
        constexpr float kRadius = 2 * 1.414f; ///< in edges
        m_inverseRadius2 = 1 / sqr(kRadius * pyramid.edge(pyramid.nodes()[node]));
    }
    /// Returns the sums of the nodes, weighted by a bell of the distance from a cell and by the angle between
    /// the normals.
    Region around(const CellNode& center) {
        m_weights.resize(m_p.size());
        weigh(center);
        Region out;
        for (size_t i = 0; i < m_regions.size(); ++i)
            out.add(m_regions[i], m_weights[i]);
        return out;
    }

  private:
    void weigh(const CellNode& center) {
        constexpr float kMinCosine = 0.9f;
        for (size_t i = 0; i < m_p.size(); ++i) {
            const float cosine = std::max((dot(center.n, m_n[i]) - kMinCosine) / (1 - kMinCosine), 0.f);
            const float bell = std::max(1 - length2(m_p[i] - center.p) * m_inverseRadius2, 0.f);
            m_weights[i] = cosine * bell * bell * bell;
        }
    }
    const RareLight& m_light;
    std::vector<V3f> m_p, m_n; ///< by node
    std::vector<Region> m_regions;
    std::vector<float> m_weights; ///< of the last cell
    uint32_t m_node = ~0u;
    float m_inverseRadius2 = 0;
};

RareLight::RareLight(const CellPyramid& pyramid, std::span<const PixelRareSample> samples,
                     float samplesPerPixel)
    : m_pyramid(pyramid), m_estimates(kParts * pyramid.cellCount()) {
    if (samples.empty())
        return;
    m_sums.resize(kParts * pyramid.nodes().size());
    for (const RareSample& sample : samples)
        forNodesOf(sample, [&](Sums& sums) {
            const float brightness = sample.light.x + sample.light.y + sample.light.z;
            sums.brightness += brightness;
            sums.squares += sqr(brightness);
        });
    const std::vector<uint32_t> cells = pyramid.cellsByNode();
    estimateRarity(samples, cells, samplesPerPixel);
    for (const RareSample& sample : samples)
        if (const float share = rarity(sample.cell, sample.part); share > 0)
            forNodesOf(sample, [&](Sums& sums) { sums.rare += sample.light * share; });
    estimateLight(cells);
}

/// Calls work(sums) for the nodes that contain a sample.
template <class Work>
void RareLight::forNodesOf(const RareSample& sample, const Work& work) {
    uint32_t node = m_pyramid.nodeOf(sample.cell);
    for (int scale = 0; scale <= CellPyramid::kScales; ++scale, node = m_pyramid.nodes()[node].parent)
        work(m_sums[kParts * node + sample.part]);
}

/// Calls work(cell, part, region, weight) for regions of increasing size around each cell: the first has
/// weight as far as it has enough samples, the next has what is left, and so on. The weights sum to 1.
/// `cells`: in the order of CellPyramid::cellsByNode, in which consecutive ones have the same surroundings.
template <class Work>
void RareLight::forRegions(std::span<const uint32_t> cells, const Work& work) const {
    constexpr size_t kRun = 512;
    parallelFor((cells.size() + kRun - 1) / kRun, [&](size_t run) {
        forRegionsOfRun(cells.subspan(run * kRun, std::min(kRun, cells.size() - run * kRun)), work);
    });
}

template <class Work>
void RareLight::forRegionsOfRun(std::span<const uint32_t> cells, const Work& work) const {
    const std::vector<CellNode>& nodes = m_pyramid.nodes();
    std::vector<Query> queries;
    for (const uint32_t cell : cells)
        queries.push_back({cell, m_pyramid.nodeOf(cell)});
    Surroundings surroundings(*this);
    for (int k = 0; k <= CellPyramid::kScales && !queries.empty(); ++k) {
        for (Query& query : queries) {
            const bool isLast = k == CellPyramid::kScales;
            const auto isSought = [&](int part) {
                return query.rest[part] > 0 && (k + 2 > CellPyramid::kScales || hasMore(query.node, part));
            };
            if (isSought(0) || isSought(1)) {
                surroundings.collect(query.node);
                const Region region = surroundings.around(nodes[m_pyramid.nodeOf(query.cell)]);
                for (int part = 0; part < kParts; ++part) {
                    if (!isSought(part))
                        continue;
                    const float share =
                        isLast ? 1
                               : std::clamp(2 * region.parts[part].effectiveCount() / kEnoughSamples - 1, 0.f,
                                            1.f);
                    if (share > 0 && region.count > 0)
                        work(query.cell, part, region, query.rest[part] * share);
                    query.rest[part] *= 1 - share;
                }
            }
            query.node = nodes[query.node].parent;
        }
        std::erase_if(queries, [](const Query& q) { return q.rest[0] <= 0 && q.rest[1] <= 0; });
    }
}

/// Returns whether the region around a node, which is not among the two largest, has some bright samples: its
/// parent's parent has.
bool RareLight::hasMore(uint32_t node, int part) const {
    const uint32_t grandparent = m_pyramid.nodes()[m_pyramid.nodes()[node].parent].parent;
    return m_sums[kParts * grandparent + size_t(part)].effectiveCount() >= kEnoughSamples / 4;
}

/// Sets the rarity of the cells with samples by the number of equally bright samples around them.
void RareLight::estimateRarity(std::span<const PixelRareSample> samples,
                               std::span<const uint32_t> cellsByNode, float samplesPerPixel) {
    std::vector<bool> hasSamples(m_estimates.size());
    for (const RareSample& sample : samples)
        hasSamples[kParts * sample.cell + sample.part] = true;
    std::vector<uint32_t> cells;
    std::copy_if(cellsByNode.begin(), cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return hasSamples[kParts * cell] || hasSamples[kParts * cell + 1]; });
    forRegions(cells, [&](uint32_t cell, int part, const Region& region, float weight) {
        float& countPerSample = m_estimates[kParts * cell + size_t(part)].rarity;
        countPerSample += weight * region.parts[part].effectiveCount() / region.count;
    });
    for (size_t i = 0; i < m_estimates.size(); ++i)
        m_estimates[i].rarity = hasSamples[i] ? rarityOf(samplesPerPixel * m_estimates[i].rarity) : 0;
}

/// Sets the light of the cells that have rare light around them.
void RareLight::estimateLight(std::span<const uint32_t> cellsByNode) {
    const std::vector<bool> isNearRare = findTopsNearRareLight();
    std::vector<uint32_t> cells;
    std::copy_if(cellsByNode.begin(), cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return isNearRare[topOf(cell)]; });
    forRegions(cells, [&](uint32_t cell, int part, const Region& region, float weight) {
        m_estimates[kParts * cell + size_t(part)].light += region.parts[part].rare * (weight / region.count);
    });
}

/// Returns the node of the largest size that contains a cell.
uint32_t RareLight::topOf(uint32_t cell) const {
    uint32_t node = m_pyramid.nodeOf(cell);
    for (int scale = 0; scale < CellPyramid::kScales; ++scale)
        node = m_pyramid.nodes()[node].parent;
    return node;
}

/// Returns, for each node of the largest size, whether it or one next to it has rare light.
std::vector<bool> RareLight::findTopsNearRareLight() const {
    std::vector<bool> out(m_pyramid.nodes().size());
    uint32_t last = ~0u;
    for (uint32_t cell = 0; cell < m_pyramid.cellCount(); ++cell)
        if (const uint32_t top = topOf(cell); top != last) {
            last = top;
            m_pyramid.forNeighbors(m_pyramid.nodes()[top], [&](uint32_t index) {
                for (size_t part = 0; part < kParts; ++part)
                    if (!isBlack(m_sums[kParts * index + part].rare))
                        out[top] = true;
            });
        }
    return out;
}

} // namespace strobe
