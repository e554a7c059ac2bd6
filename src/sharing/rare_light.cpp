#include "sharing/rare_light.h"

#include "core/util/parallel.h"

namespace strobe {

namespace {

/// Regions have as much light as this number of equally bright samples.
constexpr float kEnoughSamples = 8;
/// Samples are half rare if a pixel has this number of equally bright ones.
constexpr float kHalfRare = 0.2f;

/// Returns the number of equally bright samples whose noise is that of samples with these sums.
float effectiveCount(float brightness, float squares) { return squares > 0 ? sqr(brightness) / squares : 0; }

/// Returns the fraction of light that is rare where a pixel has this number of equally bright samples.
float rarityOf(float countPerPixel) {
    constexpr float kLeast = 0.05f; // less is 0
    return std::max(1 / (1 + sqr(countPerPixel / kHalfRare)) - kLeast, 0.f) / (1 - kLeast);
}

} // namespace

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
    std::vector<uint8_t> hasSamples(m_estimates.size(), 0);
    for (const RareSample& sample : samples)
        hasSamples[kParts * sample.cell + sample.part] = 1;
    parallelForRuns(m_estimates.size(), [&](size_t i) {
        if (hasSamples[i])
            m_estimates[i].rarity =
                rarityOf(samplesPerPixel * countPerSample(uint32_t(i / kParts), int(i % kParts)));
    });
    for (const RareSample& sample : samples)
        if (const float share = rarity(sample.cell, sample.part); share > 0)
            forNodesOf(sample, [&](Sums& sums) { sums.rare += sample.light * share; });
    findTops();
    parallelForRuns(m_estimates.size(), [&](size_t i) {
        m_estimates[i].light = lightAround(uint32_t(i / kParts), int(i % kParts));
    });
}

/// Calls work(sums) for the nodes that contain a sample.
template <class Work>
void RareLight::forNodesOf(const RareSample& sample, const Work& work) {
    uint32_t node = m_pyramid.nodeOf(sample.cell);
    for (int scale = 0; scale <= CellPyramid::kScales; ++scale, node = m_pyramid.nodes()[node].parent)
        work(m_sums[kParts * node + sample.part]);
}

/// Returns the number of equally bright samples in a node.
float RareLight::countIn(uint32_t node, int part) const {
    const Sums& sums = m_sums[kParts * node + size_t(part)];
    return effectiveCount(sums.brightness, sums.squares);
}

/// Returns the sums over nodes of the size of `scale` around a center, weighted by a bell of the distance and
/// by the angle between the normals.
RareLight::Sums RareLight::sumsAround(const CellNode& center, const CellNode& scale, int part) const {
    constexpr float kRadius = 2 * 1.414f; ///< in edges
    constexpr float kMinCosine = 0.9f;
    const float inverseRadius2 = 1 / sqr(kRadius * m_pyramid.edge(scale));
    Sums out;
    m_pyramid.forNeighbors(scale, [&](uint32_t index) {
        const CellNode& node = m_pyramid.nodes()[index];
        const float cosine = std::max((dot(center.n, node.n) - kMinCosine) / (1 - kMinCosine), 0.f);
        const float bell = std::max(1 - length2(node.p - center.p) * inverseRadius2, 0.f);
        const float weight = cosine * bell * bell * bell;
        const Sums& sums = m_sums[kParts * index + size_t(part)];
        out.brightness += weight * sums.brightness;
        out.squares += weight * sums.squares;
        out.rare += sums.rare * weight;
        out.count += weight * (node.count[0] + node.count[1]);
    });
    return out;
}

/// Calls work(sums, weight) for regions of increasing size around a cell: the first has weight as far as it
/// has enough samples, the next has what is left, and so on. The weights sum to 1.
template <class Work>
void RareLight::forRegions(uint32_t cell, int part, const Work& work) const {
    const std::vector<CellNode>& nodes = m_pyramid.nodes();
    const CellNode& center = nodes[m_pyramid.nodeOf(cell)];
    const CellNode* scale = &center;
    float rest = 1;
    for (int k = 0; k <= CellPyramid::kScales && rest > 0; ++k, scale = &nodes[scale->parent]) {
        if (k + 2 <= CellPyramid::kScales && countIn(nodes[scale->parent].parent, part) < kEnoughSamples / 4)
            continue; // the region of this size has hardly more
        const Sums sums = sumsAround(center, *scale, part);
        const float count = effectiveCount(sums.brightness, sums.squares);
        const float share =
            k == CellPyramid::kScales ? 1 : std::clamp(2 * count / kEnoughSamples - 1, 0.f, 1.f);
        if (share > 0 && sums.count > 0)
            work(sums, rest * share);
        rest *= 1 - share;
    }
}

/// Returns the number of equally bright samples per sample around a cell.
float RareLight::countPerSample(uint32_t cell, int part) const {
    float out = 0;
    forRegions(cell, part, [&](const Sums& sums, float weight) {
        out += weight * effectiveCount(sums.brightness, sums.squares) / sums.count;
    });
    return out;
}

Rgb RareLight::lightAround(uint32_t cell, int part) const {
    Rgb out(0);
    if (m_isNearRare[kParts * topOf(cell) + size_t(part)])
        forRegions(cell, part,
                   [&](const Sums& sums, float weight) { out += sums.rare * (weight / sums.count); });
    return out;
}

/// Returns the node of the largest size that contains a cell.
uint32_t RareLight::topOf(uint32_t cell) const {
    uint32_t node = m_pyramid.nodeOf(cell);
    for (int scale = 0; scale < CellPyramid::kScales; ++scale)
        node = m_pyramid.nodes()[node].parent;
    return node;
}

/// Finds the largest nodes with rare light in them or next to them.
void RareLight::findTops() {
    m_isNearRare.resize(m_sums.size());
    uint32_t last = ~0u;
    for (uint32_t cell = 0; cell < m_pyramid.cellCount(); ++cell)
        if (const uint32_t top = topOf(cell); top != last) {
            last = top;
            m_pyramid.forNeighbors(m_pyramid.nodes()[top], [&](uint32_t index) {
                for (size_t part = 0; part < kParts; ++part)
                    if (!isBlack(m_sums[kParts * index + part].rare))
                        m_isNearRare[kParts * top + part] = 1;
            });
        }
}

} // namespace strobe
