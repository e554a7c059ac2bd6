#include "sharing/bright_regions.h"

#include "core/util/parallel.h"
#include "sharing/surface_scales.h"

#include <algorithm>
#include <cstring>

namespace strobe {

namespace {

/// Regions have as much light as this number of equally bright samples. More samples have less noise, wider
/// regions more bias: measured.
constexpr float kEnoughSamples = 4;
/// The radii of a region and of its core, in edges of its nodes.
constexpr float kRadius = 2 * 1.414f, kCoreRadius = kRadius / 2;

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

} // namespace

/// A cell whose regions are sought.
struct BrightRegions::Query {
    uint32_t cell, node;
    float rest = 1; ///< the weight that smaller regions left
};

/// The nodes of the size of one node around it, and what they hold.
class BrightRegions::Surroundings {
  public:
    explicit Surroundings(const BrightRegions& regions)
        : m_pyramid(regions.m_pyramid), m_sums(regions.m_sums), m_neighbors(m_pyramid) {}
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
            if (const BrightSums& sums = m_sums[index]; sums.brightness > 0)
                m_bright.push_back({neighbor.p,
                                    neighbor.n,
                                    {sums.brightness, sums.squares, sums.rare.x, sums.rare.y, sums.rare.z}});
        }
        m_edge = m_pyramid.edge(m_pyramid.nodes()[node]);
    }
    /// Writes the weighted sums around each point over the bright samples. `radius`: in edges of the nodes.
    void sumBright(const Points& points, float radius, BrightSums* out) const {
        float sums[5][Points::kMax] = {};
        if (!m_bright.empty())
            sumAround(points, m_bright.data(), m_bright.size(), inverseSquare(radius), m_minCosine, sums);
        for (int i = 0; i < points.count; ++i)
            out[i] = {sums[0][i], sums[1][i], Rgb(sums[2][i], sums[3][i], sums[4][i])};
    }
    /// Writes the weighted numbers of all samples around each point.
    void count(const Points& points, float radius, float (&out)[1][Points::kMax]) const {
        sumAround(points, m_all.data(), m_all.size(), inverseSquare(radius), m_minCosine, out);
    }

  private:
    /// Returns the cosine of the largest angle between the normals of a point and of the nodes of its region.
    /// Nodes of the largest regions are few, and each has one mean normal: many points would have no node
    /// within a small angle.
    static float minCosine(int larger) { return larger == 0 ? 0.f : larger == 1 ? 0.7f : 0.9f; }
    float inverseSquare(float radius) const { return 1 / sqr(radius * m_edge); }

    const CellPyramid& m_pyramid;
    const HugeVector<BrightSums>& m_sums;
    CellPyramid::Neighbors m_neighbors;
    std::vector<Summand<1>> m_all;
    std::vector<Summand<5>> m_bright; ///< with bright samples
    uint32_t m_node = ~0u;
    float m_edge = 0, m_minCosine = 0;
};

BrightRegions::BrightRegions(const CellPyramid& pyramid)
    : m_pyramid(pyramid), m_sums(pyramid.nodes().size()), m_scales(surfaceScales(pyramid)) {}

void BrightRegions::clear() { std::fill(m_sums.begin(), m_sums.end(), BrightSums{}); }

void BrightRegions::forEach(std::span<const uint32_t> cells, Extent extent, const Visit& visit) const {
    constexpr size_t kRun = 512;
    parallelFor((cells.size() + kRun - 1) / kRun, [&](size_t run) {
        visitRun(cells.subspan(run * kRun, std::min(kRun, cells.size() - run * kRun)), extent, visit);
    });
}

BrightRegion BrightRegions::coreOf(uint32_t cell) const {
    const uint32_t node = m_pyramid.nodeOf(cell);
    Surroundings surroundings(*this);
    constexpr int kManyLarger = 2; // the core is small on small surfaces, too
    surroundings.collect(node, kManyLarger);
    Points points;
    points.add(m_pyramid.nodes()[node]);
    BrightRegion core{};
    surroundings.sumBright(points, kCoreRadius, &core.sums);
    float counts[1][Points::kMax];
    surroundings.count(points, kCoreRadius, counts);
    core.count = counts[0][0];
    return core;
}

void BrightRegions::visitRun(std::span<const uint32_t> cells, Extent extent, const Visit& visit) const {
    std::vector<Query> queries;
    for (const uint32_t cell : cells)
        queries.push_back({cell, m_pyramid.nodeOf(cell)});
    Surroundings surroundings(*this);
    for (int size = 0; size < kSizes && !queries.empty(); ++size) {
        for (size_t first = 0, end = 0; first < queries.size(); first = end) {
            const uint32_t node = queries[first].node;
            while (end < queries.size() && queries[end].node == node && end - first < Points::kMax)
                ++end;
            const std::span<Query> sameNode(&queries[first], end - first);
            // Cells with the same node at one size have the same edge and surface.
            const int larger = largestSize(queries[first].cell) - size;
            if (larger < 2 || hasMore(node)) {
                surroundings.collect(node, larger);
                visitSize(surroundings, sameNode, size, extent, visit);
            }
            for (Query& query : sameNode)
                query.node = m_pyramid.nodes()[node].parent;
        }
        std::erase_if(queries, [&](const Query& query) {
            return extent == Extent::All ? size >= largestSize(query.cell) : query.rest <= 0;
        });
    }
}

/// Visits the regions of one size around cells with the same node: see forEach.
void BrightRegions::visitSize(const Surroundings& surroundings, std::span<Query> queries, int size,
                              Extent extent, const Visit& visit) const {
    Points points;
    for (const Query& query : queries)
        points.add(m_pyramid.nodes()[m_pyramid.nodeOf(query.cell)]);
    BrightSums sums[Points::kMax];
    surroundings.sumBright(points, kRadius, sums);
    float counts[1][Points::kMax];
    bool hasCounts = false; // few regions need them
    for (size_t i = 0; i < queries.size(); ++i) {
        const bool isLargest = size == largestSize(queries[i].cell);
        const float share = weightOf(sums[i].effectiveCount(), kEnoughSamples);
        const float weight = queries[i].rest * share, rest = queries[i].rest - weight;
        if (sums[i].brightness > 0 && (share > 0 || isLargest || extent == Extent::All)) {
            if (!hasCounts)
                surroundings.count(points, kRadius, counts);
            hasCounts = true;
            visit(queries[i].cell, BrightRegion{sums[i], counts[0][i], weight, isLargest ? rest : 0, size});
        }
        queries[i].rest = isLargest ? 0 : rest;
    }
}

/// Returns whether the region around a node, which is not among the two largest, has some bright samples: its
/// parent's parent has.
bool BrightRegions::hasMore(uint32_t node) const {
    const uint32_t grandparent = m_pyramid.nodes()[m_pyramid.nodes()[node].parent].parent;
    return m_sums[grandparent].effectiveCount() >= kEnoughSamples / 4;
}

} // namespace strobe
