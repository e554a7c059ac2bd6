#include "sharing/rare_light.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <iterator>

namespace strobe {

namespace {

/// Regions have as much light as this number of equally bright samples. More samples have less noise, wider
/// regions more bias: measured.
constexpr float kEnoughSamples = 4;
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

/// Sums over samples, weighted.
struct Sums {
    float brightness = 0, squares = 0; ///< of the light above the limit
    Rgb rare = Rgb(0);
    /// Returns the number of equally bright samples whose noise is that of these samples.
    float effectiveCount() const { return squares > 0 ? sqr(brightness) / squares : 0; }
};

/// Sums over the nodes around a cell, by part.
struct Region {
    Sums parts[kParts];
    float count = 0; ///< of all samples
};

/// The nodes of the size of one node around it, and what they hold.
class Surroundings {
  public:
    /// `sums`: by node, by part.
    Surroundings(const CellPyramid& pyramid, const HugeVector<Sums>& sums)
        : m_pyramid(pyramid), m_sums(sums) {}
    /// Collects the nodes around a node.
    void collect(uint32_t node) {
        if (m_node == node)
            return;
        m_node = node;
        m_rows.clear();
        m_count = 0;
        m_pyramid.forNeighbors(m_pyramid.nodes()[node], [&](uint32_t index) { add(index); });
        constexpr float kRadius = 2 * 1.414f; ///< in edges
        m_inverseRadius2 = 1 / sqr(kRadius * m_pyramid.edge(m_pyramid.nodes()[node]));
    }
    /// Returns the sums of the nodes, weighted by a bell of the distance from a cell and by the angle between
    /// the normals.
    Region around(const CellNode& center) const {
        WeightedSums sums;
        addRows(m_rows.data(), int(m_rows.size()), center.p, center.n, m_inverseRadius2, sums);
        Region out;
        const auto total = [&](int column) {
            float sum = 0;
            for (const float lane : sums.lanes[column])
                sum += lane;
            return sum;
        };
        out.count = total(kCount);
        for (int part = 0; part < kParts; ++part) {
            const int first = kSums + kSumColumns * part;
            out.parts[part] = {total(first), total(first + 1),
                               Rgb(total(first + 2), total(first + 3), total(first + 4))};
        }
        return out;
    }

  private:
    static constexpr int kLanes = 8, kSumColumns = 5;
    /// The columns of a row; then the members of Sums by part.
    enum Column { kP = 0, kN = 3, kCount = 0, kSums = 1, kSummed = kSums + kSumColumns * kParts };
    /// Nodes as a structure of arrays: position and normal, then what is summed.
    struct Row {
        float geometry[6][kLanes];
        float summed[kSummed][kLanes];
    };
    struct WeightedSums {
        float lanes[kSummed][kLanes] = {};
    };
    void add(uint32_t index) {
        const int lane = m_count++ % kLanes;
        if (lane == 0)
            m_rows.emplace_back(); // zeros have no weight
        Row& row = m_rows.back();
        const CellNode& node = m_pyramid.nodes()[index];
        for (int k = 0; k < 3; ++k) {
            row.geometry[kP + k][lane] = node.p[k];
            row.geometry[kN + k][lane] = node.n[k];
        }
        row.summed[kCount][lane] = node.count[0] + node.count[1];
        for (int part = 0; part < kParts; ++part) {
            const Sums& sums = m_sums[kParts * index + size_t(part)];
            const float values[kSumColumns] = {sums.brightness, sums.squares, sums.rare.x, sums.rare.y,
                                               sums.rare.z};
            for (int k = 0; k < kSumColumns; ++k)
                row.summed[kSums + kSumColumns * part + k][lane] = values[k];
        }
    }
    static void addRows(const Row* rows, int count, const V3f& p, const V3f& n, float inverseRadius2,
                        WeightedSums& out);

    const CellPyramid& m_pyramid;
    const HugeVector<Sums>& m_sums;
    std::vector<Row> m_rows;
    int m_count = 0; ///< nodes
    uint32_t m_node = ~0u;
    float m_inverseRadius2 = 0;
};

STROBE_TARGET_CLONES void Surroundings::addRows(const Row* rows, int count, const V3f& p, const V3f& n,
                                                float inverseRadius2, WeightedSums& out) {
    constexpr float kMinCosine = 0.9f;
    for (int r = 0; r < count; ++r) {
        const Row& row = rows[r];
        float weights[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            const auto& g = row.geometry;
            const float x = g[kP][i] - p.x, y = g[kP + 1][i] - p.y, z = g[kP + 2][i] - p.z;
            const float dot = g[kN][i] * n.x + g[kN + 1][i] * n.y + g[kN + 2][i] * n.z;
            const float cosine = std::max((dot - kMinCosine) / (1 - kMinCosine), 0.f);
            const float bell = std::max(1 - (x * x + y * y + z * z) * inverseRadius2, 0.f);
            weights[i] = cosine * bell * bell * bell;
        }
        for (int c = 0; c < kSummed; ++c)
            for (int i = 0; i < kLanes; ++i)
                out.lanes[c][i] += weights[i] * row.summed[c][i];
    }
}

} // namespace

/// Sets the estimates of a RareLight.
class RareLight::Estimator {
  public:
    /// `cellsByNode`: in the order of CellPyramid::cellsByNode, in which consecutive ones have the same
    /// surroundings. `estimates`: by cell, by part; initially without light.
    Estimator(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
              std::span<const PixelRareSample> samples, float samplesPerPixel,
              HugeVector<Estimate>& estimates);

  private:
    template <class Work>
    void forNodesOf(const RareSample& sample, const Work& work);
    template <class Work>
    void forRegions(std::span<const uint32_t> cells, const Work& work) const;
    template <class Work>
    void forRegionsOfRun(std::span<const uint32_t> cells, const Work& work) const;
    bool hasMore(uint32_t node, int part) const;
    void estimateRarity(std::span<const PixelRareSample> samples, float samplesPerPixel);
    void estimateLight();
    uint32_t topOf(uint32_t cell) const;
    std::vector<bool> findTopsNearRareLight() const;

    const CellPyramid& m_pyramid;
    const std::span<const uint32_t> m_cellsByNode;
    HugeVector<Estimate>& m_estimates;
    HugeVector<Sums> m_sums; ///< by node, by part
};

RareLight::RareLight(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                     std::span<const PixelRareSample> samples, float samplesPerPixel) {
    if (samples.empty())
        return;
    m_estimates.resize(kParts * pyramid.cellCount());
    Estimator(pyramid, cellsByNode, samples, samplesPerPixel, m_estimates);
}

RareLight::Estimator::Estimator(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                                std::span<const PixelRareSample> samples, float samplesPerPixel,
                                HugeVector<Estimate>& estimates)
    : m_pyramid(pyramid), m_cellsByNode(cellsByNode), m_estimates(estimates),
      m_sums(kParts * pyramid.nodes().size()) {
    for (const RareSample& sample : samples)
        forNodesOf(sample, [&](Sums& sums) {
            const float brightness = sample.light.x + sample.light.y + sample.light.z;
            sums.brightness += brightness;
            sums.squares += sqr(brightness);
        });
    estimateRarity(samples, samplesPerPixel);
    for (const RareSample& sample : samples)
        if (const float share = m_estimates[kParts * sample.cell + sample.part].rarity; share > 0)
            forNodesOf(sample, [&](Sums& sums) { sums.rare += sample.light * share; });
    estimateLight();
}

/// Calls work(sums) for the nodes that contain a sample.
template <class Work>
void RareLight::Estimator::forNodesOf(const RareSample& sample, const Work& work) {
    m_pyramid.forEachAncestor(m_pyramid.nodeOf(sample.cell),
                              [&](uint32_t node) { work(m_sums[kParts * node + sample.part]); });
}

/// Calls work(cell, part, region, weight) for regions of increasing size around each cell: the first has
/// weight as far as it has enough samples, the next has what is left, and so on. The weights sum to 1.
/// `cells`: in the order of m_cellsByNode.
template <class Work>
void RareLight::Estimator::forRegions(std::span<const uint32_t> cells, const Work& work) const {
    constexpr size_t kRun = 512;
    parallelFor((cells.size() + kRun - 1) / kRun, [&](size_t run) {
        forRegionsOfRun(cells.subspan(run * kRun, std::min(kRun, cells.size() - run * kRun)), work);
    });
}

template <class Work>
void RareLight::Estimator::forRegionsOfRun(std::span<const uint32_t> cells, const Work& work) const {
    const std::span<const CellNode> nodes = m_pyramid.nodes();
    std::vector<Query> queries;
    for (const uint32_t cell : cells)
        queries.push_back({cell, m_pyramid.nodeOf(cell)});
    Surroundings surroundings(m_pyramid, m_sums);
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
bool RareLight::Estimator::hasMore(uint32_t node, int part) const {
    const uint32_t grandparent = m_pyramid.nodes()[m_pyramid.nodes()[node].parent].parent;
    return m_sums[kParts * grandparent + size_t(part)].effectiveCount() >= kEnoughSamples / 4;
}

/// Sets the rarity of the cells with samples by the number of equally bright samples around them.
void RareLight::Estimator::estimateRarity(std::span<const PixelRareSample> samples, float samplesPerPixel) {
    std::vector<bool> hasSamples(m_estimates.size());
    for (const RareSample& sample : samples)
        hasSamples[kParts * sample.cell + sample.part] = true;
    std::vector<uint32_t> cells;
    std::copy_if(m_cellsByNode.begin(), m_cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return hasSamples[kParts * cell] || hasSamples[kParts * cell + 1]; });
    forRegions(cells, [&](uint32_t cell, int part, const Region& region, float weight) {
        float& countPerSample = m_estimates[kParts * cell + size_t(part)].rarity;
        countPerSample += weight * region.parts[part].effectiveCount() / region.count;
    });
    for (size_t i = 0; i < m_estimates.size(); ++i)
        m_estimates[i].rarity = hasSamples[i] ? rarityOf(samplesPerPixel * m_estimates[i].rarity) : 0;
}

/// Sets the light of the cells that have rare light around them.
void RareLight::Estimator::estimateLight() {
    const std::vector<bool> isNearRare = findTopsNearRareLight();
    std::vector<uint32_t> cells;
    std::copy_if(m_cellsByNode.begin(), m_cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return isNearRare[topOf(cell)]; });
    forRegions(cells, [&](uint32_t cell, int part, const Region& region, float weight) {
        m_estimates[kParts * cell + size_t(part)].light += region.parts[part].rare * (weight / region.count);
    });
}

/// Returns the node of the largest size that contains a cell.
uint32_t RareLight::Estimator::topOf(uint32_t cell) const {
    uint32_t node = m_pyramid.nodeOf(cell);
    for (int scale = 0; scale < CellPyramid::kScales; ++scale)
        node = m_pyramid.nodes()[node].parent;
    return node;
}

/// Returns, for each node of the largest size, whether it or one next to it has rare light.
std::vector<bool> RareLight::Estimator::findTopsNearRareLight() const {
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
