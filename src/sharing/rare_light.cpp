#include "sharing/rare_light.h"

#include "core/util/parallel.h"
#include "sharing/surface_scales.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

namespace strobe {

namespace {

/// Regions have as much light as this number of equally bright samples. More samples have less noise, wider
/// regions more bias: measured.
constexpr float kEnoughSamples = 4;
/// Surfaces with fewer samples share their light if they are as many as this number of equally large ones.
constexpr float kEnoughSurfaces = 4;
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
    float rest = 1; ///< the weight that smaller regions left
};

/// Sums over samples above the limit, weighted.
struct Sums {
    float brightness = 0, squares = 0;
    Rgb rare = Rgb(0);
    /// Returns the number of equally bright samples whose noise is that of these samples.
    float effectiveCount() const { return squares > 0 ? sqr(brightness) / squares : 0; }
};

/// Returns the weight of a mean over a number of equal things: 0 up to half of what is enough.
float weightOf(float count, float enough) { return std::clamp(2 * count / enough - 1, 0.f, 1.f); }

/// A region around a cell.
struct Region {
    Sums sums;
    float count;  ///< of all samples, weighted
    float weight; ///< of the region among those of the cell
    float rest;   ///< the weight that the regions of the cell leave, if this is the largest
};

/// The weight that the regions of a cell leave, and the rare light per sample of the largest.
struct Rest {
    float weight = 0;
    Rgb light = Rgb(0);
};

/// Some points of a surface, as a structure of arrays.
struct Points {
    static constexpr int kMax = 8;
    /// One float for each point.
    typedef float Floats __attribute__((vector_size(kMax * sizeof(float))));
    alignas(Floats) float p[3][kMax] = {};
    alignas(Floats) float n[3][kMax] = {};
    int count = 0;

    void add(const CellNode& node) {
        for (int k = 0; k < 3; ++k) {
            p[k][count] = node.p[k];
            n[k][count] = node.n[k];
        }
        ++count;
    }
};

/// A node, and what is to be summed over nodes.
template <int kColumns>
struct Summand {
    V3f p, n;
    float values[kColumns];
};

/// Writes sums over nodes for each point, weighted by a bell of the distance from the point and by the angle
/// between the normals, whose cosine must exceed `minCosine`.
template <int kColumns>
STROBE_TARGET_CLONES void sumAround(const Points& points, const Summand<kColumns>* nodes, size_t count,
                                    float inverseRadius2, float minCosine,
                                    float (&out)[kColumns][Points::kMax]) {
    using Floats = Points::Floats;
    Floats p[3], n[3];
    std::memcpy(p, points.p, sizeof p);
    std::memcpy(n, points.n, sizeof n);
    const Floats zero = {};
    Floats sums[kColumns] = {};
    for (size_t k = 0; k < count; ++k) {
        const Summand<kColumns>& node = nodes[k];
        const Floats x = node.p.x - p[0], y = node.p.y - p[1], z = node.p.z - p[2];
        const Floats dot = node.n.x * n[0] + node.n.y * n[1] + node.n.z * n[2];
        const Floats cosine = (dot - minCosine) / (1 - minCosine);
        const Floats bell = 1 - (x * x + y * y + z * z) * inverseRadius2;
        const Floats weights = (cosine > zero ? cosine : zero) * (bell > zero ? bell * bell * bell : zero);
        for (int c = 0; c < kColumns; ++c)
            sums[c] += weights * node.values[c];
    }
    std::memcpy(out, sums, sizeof out);
}

/// The nodes of the size of one node around it, and what they hold.
class Surroundings {
  public:
    /// `sums`: by node.
    Surroundings(const CellPyramid& pyramid, const HugeVector<Sums>& sums)
        : m_pyramid(pyramid), m_sums(sums), m_neighbors(pyramid) {}
    /// Collects the nodes around a node. `larger`: the number of larger regions.
    void collect(uint32_t node, int larger) {
        m_minCosine = minCosine(larger);
        if (m_node == node)
            return;
        m_node = node;
        m_all.clear();
        m_bright.clear();
        for (const uint32_t index : m_neighbors.of(node)) {
            const CellNode& neighbor = m_pyramid.nodes()[index];
            m_all.push_back({neighbor.p, neighbor.n, {neighbor.count[0] + neighbor.count[1]}});
            if (const Sums& sums = m_sums[index]; sums.brightness > 0)
                m_bright.push_back({neighbor.p,
                                    neighbor.n,
                                    {sums.brightness, sums.squares, sums.rare.x, sums.rare.y, sums.rare.z}});
        }
        constexpr float kRadius = 2 * 1.414f; ///< in edges
        m_inverseRadius2 = 1 / sqr(kRadius * m_pyramid.edge(m_pyramid.nodes()[node]));
    }
    /// Writes the weighted sums around each point over the samples above the limit.
    void sumBright(const Points& points, Sums* out) const {
        float sums[5][Points::kMax] = {};
        if (!m_bright.empty())
            sumAround(points, m_bright.data(), m_bright.size(), m_inverseRadius2, m_minCosine, sums);
        for (int i = 0; i < points.count; ++i)
            out[i] = {sums[0][i], sums[1][i], Rgb(sums[2][i], sums[3][i], sums[4][i])};
    }
    /// Writes the weighted numbers of all samples around each point.
    void count(const Points& points, float (&out)[1][Points::kMax]) const {
        sumAround(points, m_all.data(), m_all.size(), m_inverseRadius2, m_minCosine, out);
    }

  private:
    /// Returns the cosine of the largest angle between the normals of a point and of the nodes of its region.
    /// Nodes of the largest regions are few, and each has one mean normal: many points would have no node
    /// within a small angle.
    static float minCosine(int larger) { return larger == 0 ? 0.f : larger == 1 ? 0.7f : 0.9f; }

    const CellPyramid& m_pyramid;
    const HugeVector<Sums>& m_sums;
    CellPyramid::Neighbors m_neighbors;
    std::vector<Summand<1>> m_all;
    std::vector<Summand<5>> m_bright; ///< with samples above the limit
    uint32_t m_node = ~0u;
    float m_inverseRadius2 = 0, m_minCosine = 0;
};

} // namespace

/// Sets the estimates of a RareLight.
class RareLight::Estimator {
  public:
    /// `cellsByNode`: in the order of CellPyramid::cellsByNode, in which consecutive ones have the same
    /// surroundings. `samples`: of one part. `estimates`: by cell; initially without light.
    Estimator(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
              std::span<const RareSample> samples, float samplesPerPixel, HugeVector<Estimate>& estimates);

  private:
    template <class Work>
    void forNodesOf(const RareSample& sample, const Work& work);
    template <class Work>
    void forRegions(std::span<const uint32_t> cells, const Work& work) const;
    template <class Work>
    void forRegionsOfRun(std::span<const uint32_t> cells, const Work& work) const;
    template <class Work>
    void forRegionsOfSize(const Surroundings& surroundings, std::span<Query> queries, bool isLargest,
                          const Work& work) const;
    bool hasMore(uint32_t node) const;
    void estimateRarity(std::span<const RareSample> samples, float samplesPerPixel);
    void estimateLight();
    void addRests(std::span<const Rest> rests);
    uint32_t topOf(uint32_t cell) const;
    std::vector<bool> findTopsNearRareLight() const;

    const CellPyramid& m_pyramid;
    const std::span<const uint32_t> m_cellsByNode;
    HugeVector<Estimate>& m_estimates;
    HugeVector<Sums> m_sums;            ///< by node
    const HugeVector<uint8_t> m_scales; ///< of the largest regions, by cell
};

RareLight::RareLight(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                     std::span<const PixelRareSample> samples, LightPart part, float samplesPerPixel) {
    std::vector<RareSample> ofPart;
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(ofPart),
                 [&](const RareSample& sample) { return LightPart(sample.part) == part; });
    if (ofPart.empty())
        return;
    m_estimates.resize(pyramid.cellCount());
    Estimator(pyramid, cellsByNode, ofPart, samplesPerPixel, m_estimates);
}

RareLight::Estimator::Estimator(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                                std::span<const RareSample> samples, float samplesPerPixel,
                                HugeVector<Estimate>& estimates)
    : m_pyramid(pyramid), m_cellsByNode(cellsByNode), m_estimates(estimates), m_sums(pyramid.nodes().size()),
      m_scales(surfaceScales(pyramid)) {
    for (const RareSample& sample : samples)
        forNodesOf(sample, [&](Sums& sums) {
            const float brightness = sample.light.x + sample.light.y + sample.light.z;
            sums.brightness += brightness;
            sums.squares += sqr(brightness);
        });
    estimateRarity(samples, samplesPerPixel);
    for (const RareSample& sample : samples)
        if (const float share = m_estimates[sample.cell].rarity; share > 0)
            forNodesOf(sample, [&](Sums& sums) { sums.rare += sample.light * share; });
    estimateLight();
}

/// Calls work(sums) for the nodes that contain a sample.
template <class Work>
void RareLight::Estimator::forNodesOf(const RareSample& sample, const Work& work) {
    m_pyramid.forEachAncestor(m_pyramid.nodeOf(sample.cell), [&](uint32_t node) { work(m_sums[node]); });
}

/// Calls work(cell, region) for regions of increasing size around each cell, up to that of its surface: the
/// first has weight as far as it has enough samples above the limit, the next has what is left, and so on.
/// The weights and the rest of the largest region sum to 1. `cells`: in the order of m_cellsByNode.
template <class Work>
void RareLight::Estimator::forRegions(std::span<const uint32_t> cells, const Work& work) const {
    constexpr size_t kRun = 512;
    parallelFor((cells.size() + kRun - 1) / kRun, [&](size_t run) {
        forRegionsOfRun(cells.subspan(run * kRun, std::min(kRun, cells.size() - run * kRun)), work);
    });
}

template <class Work>
void RareLight::Estimator::forRegionsOfRun(std::span<const uint32_t> cells, const Work& work) const {
    std::vector<Query> queries;
    for (const uint32_t cell : cells)
        queries.push_back({cell, m_pyramid.nodeOf(cell)});
    Surroundings surroundings(m_pyramid, m_sums);
    for (int k = 0; k <= CellPyramid::kScales && !queries.empty(); ++k) {
        for (size_t first = 0, end = 0; first < queries.size(); first = end) {
            const uint32_t node = queries[first].node;
            while (end < queries.size() && queries[end].node == node && end - first < Points::kMax)
                ++end;
            const std::span<Query> sameNode(&queries[first], end - first);
            // Cells with the same node at one k have the same edge and surface.
            const int larger = m_scales[queries[first].cell] - k;
            if (larger < 2 || hasMore(node)) {
                surroundings.collect(node, larger);
                forRegionsOfSize(surroundings, sameNode, larger == 0, work);
            }
            for (Query& query : sameNode)
                query.node = m_pyramid.nodes()[node].parent;
        }
        std::erase_if(queries, [](const Query& query) { return query.rest <= 0; });
    }
}

/// Visits the regions of one size around cells with the same node: see forRegions.
template <class Work>
void RareLight::Estimator::forRegionsOfSize(const Surroundings& surroundings, std::span<Query> queries,
                                            bool isLargest, const Work& work) const {
    Points points;
    for (const Query& query : queries)
        points.add(m_pyramid.nodes()[m_pyramid.nodeOf(query.cell)]);
    Sums sums[Points::kMax];
    surroundings.sumBright(points, sums);
    float counts[1][Points::kMax];
    bool hasCounts = false; // few regions need them
    for (size_t i = 0; i < queries.size(); ++i) {
        const float share = weightOf(sums[i].effectiveCount(), kEnoughSamples);
        const float weight = queries[i].rest * share, rest = queries[i].rest - weight;
        if (sums[i].brightness > 0 && (share > 0 || isLargest)) {
            if (!hasCounts)
                surroundings.count(points, counts);
            hasCounts = true;
            work(queries[i].cell, Region{sums[i], counts[0][i], weight, isLargest ? rest : 0});
        }
        queries[i].rest = isLargest ? 0 : rest;
    }
}

/// Returns whether the region around a node, which is not among the two largest, has some bright samples: its
/// parent's parent has.
bool RareLight::Estimator::hasMore(uint32_t node) const {
    const uint32_t grandparent = m_pyramid.nodes()[m_pyramid.nodes()[node].parent].parent;
    return m_sums[grandparent].effectiveCount() >= kEnoughSamples / 4;
}

/// Sets the rarity of the cells with samples by the number of equally bright samples around them.
void RareLight::Estimator::estimateRarity(std::span<const RareSample> samples, float samplesPerPixel) {
    std::vector<bool> hasSamples(m_estimates.size());
    for (const RareSample& sample : samples)
        hasSamples[sample.cell] = true;
    std::vector<uint32_t> cells;
    std::copy_if(m_cellsByNode.begin(), m_cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return hasSamples[cell]; });
    forRegions(cells, [&](uint32_t cell, const Region& region) {
        const float weight = region.weight + region.rest;
        m_estimates[cell].rarity += weight * region.sums.effectiveCount() / region.count; // per sample
    });
    for (const uint32_t cell : cells)
        m_estimates[cell].rarity = rarityOf(samplesPerPixel * m_estimates[cell].rarity);
}

/// Sets the light of the cells that have rare light around them.
void RareLight::Estimator::estimateLight() {
    const std::vector<bool> isNearRare = findTopsNearRareLight();
    std::vector<uint32_t> cells;
    std::copy_if(m_cellsByNode.begin(), m_cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return isNearRare[topOf(cell)]; });
    HugeVector<Rest> rests(m_estimates.size());
    forRegions(cells, [&](uint32_t cell, const Region& region) {
        const Rgb light = region.sums.rare * (1 / region.count);
        m_estimates[cell].light += light * region.weight;
        rests[cell] = {region.rest, light};
    });
    addRests(rests);
}

/// Adds the light of the weights that are left. A surface whose largest region has not enough samples has the
/// mean of all such surfaces, if they are enough: a single bright sample would light a small surface.
void RareLight::Estimator::addRests(std::span<const Rest> rests) {
    double samples = 0, squares = 0, ofSurface = 0, light[3] = {};
    uint64_t surface = 0;
    const auto endSurface = [&] { squares += sqr(std::exchange(ofSurface, 0.)); };
    for (size_t cell = 0; cell < rests.size(); ++cell) {
        if (!(rests[cell].weight > 0))
            continue;
        const CellNode& node = m_pyramid.nodes()[m_pyramid.nodeOf(cell)];
        const uint64_t ofCell = m_pyramid.surfaceOf(node);
        if (std::exchange(surface, ofCell) != ofCell)
            endSurface();
        const double count = double(rests[cell].weight * (node.count[0] + node.count[1]));
        samples += count;
        ofSurface += count;
        for (int c = 0; c < 3; ++c)
            light[c] += count * double(rests[cell].light[c]);
    }
    endSurface();
    if (!(samples > 0))
        return;
    const float common = weightOf(float(sqr(samples) / squares), kEnoughSurfaces);
    Rgb mean;
    for (int c = 0; c < 3; ++c)
        mean[c] = float(light[c] / samples);
    for (size_t cell = 0; cell < rests.size(); ++cell)
        m_estimates[cell].light += (mean * common + rests[cell].light * (1 - common)) * rests[cell].weight;
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
    constexpr size_t kRun = 4096;
    const size_t count = m_pyramid.cellCount();
    std::vector<std::vector<uint32_t>> found((count + kRun - 1) / kRun);
    parallelFor(found.size(), [&](size_t run) {
        CellPyramid::Neighbors neighbors(m_pyramid);
        uint32_t last = ~0u;
        for (size_t cell = run * kRun; cell < std::min(count, (run + 1) * kRun); ++cell) {
            const uint32_t top = topOf(uint32_t(cell));
            if (top == std::exchange(last, top))
                continue;
            const std::span<const uint32_t> around = neighbors.of(top);
            if (std::any_of(around.begin(), around.end(),
                            [&](uint32_t node) { return !isBlack(m_sums[node].rare); }))
                found[run].push_back(top);
        }
    });
    std::vector<bool> out(m_pyramid.nodes().size());
    for (const auto& ofRun : found)
        for (const uint32_t top : ofRun)
            out[top] = true;
    return out;
}

} // namespace strobe
