#include "sharing/rare_light.h"

#include "core/util/parallel.h"
#include "sharing/bright_regions.h"
#include "sharing/errors/highlights.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

namespace strobe {

namespace {

/// Surfaces with fewer samples share their light if they are as many as this number of equally large ones.
constexpr float kEnoughSurfaces = 4;
/// Samples are half rare if a pixel has this number of equally bright ones.
constexpr float kHalfRare = 0.2f;

/// Light of few samples is credible up to this number of times the other light of its surface, or if it is
/// dark: sum of the channels.
constexpr float kCredible = 8, kDark = 0.1f;

/// Returns the fraction of light that is rare where a pixel has this number of equally bright samples.
float rarityOf(float countPerPixel) {
    constexpr float kLeast = 0.05f; // less is 0
    return std::max(1 / (1 + sqr(countPerPixel / kHalfRare)) - kLeast, 0.f) / (1 - kLeast);
}

float sum(const Rgb& c) { return c.x + c.y + c.z; }

/// Returns the light of a sample that is not rare.
Rgb commonOf(const PixelRareSample& sample, const RareLight& rare) {
    return sample.light * (1 - rare.rarity(sample.cell));
}

/// The samples of a cell, in the regions around it.
class Group {
  public:
    void set(const BrightRegion& region) {
        m_bright[region.size] = region.sums.effectiveCount();
        m_all[region.size] = region.count;
    }
    /// Sets the weights of the samples in regions of all sizes up to the largest.
    void setWeights(int largest) {
        for (int size = 0; size < BrightRegions::kSizes; ++size)
            m_weights[size] = weightIn(std::min(size, largest));
    }
    /// Returns the weight, in [0,1], of the samples in regions of a size: 0 if a smaller region has many more
    /// bright samples than chance brings together at the density of that region.
    float weight(int size) const { return m_weights[std::min(size, BrightRegions::kSizes - 1)]; }

  private:
    float weightIn(int size) const {
        // Beside the sample itself and the expected number, in units of 1 + its standard deviation:
        constexpr float kByChance = 1.5f, kNotByChance = 3;
        float excess = 0;
        for (int smaller = 0; smaller < size; ++smaller) {
            if (!(m_all[size] > 0 && m_all[smaller] > 0))
                continue;
            const float expected = m_bright[size] * m_all[smaller] / m_all[size];
            excess = std::max(excess, (m_bright[smaller] - 1 - expected) / (1 + std::sqrt(expected)));
        }
        return std::clamp((kNotByChance - excess) / (kNotByChance - kByChance), 0.f, 1.f);
    }

    // By size:
    float m_bright[BrightRegions::kSizes] = {}; ///< equally bright samples, weighted
    float m_all[BrightRegions::kSizes] = {};    ///< all samples, weighted
    float m_weights[BrightRegions::kSizes] = {};
};

/// The weight that the regions of a cell leave, and the rare light per sample of the largest.
struct Rest {
    float weight = 0;
    Rgb light = Rgb(0);
};

} // namespace

/// Sets the estimates of a RareLight.
class RareLight::Estimator {
  public:
    /// `cellsByNode`: in the order of CellPyramid::cellsByNode. `samples`: of one part. `estimates`: by cell;
    /// initially without light.
    Estimator(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
              std::span<const RareSample> samples, LightPart part, float samplesPerPixel,
              HugeVector<Estimate>& estimates);

  private:
    static constexpr uint32_t kNone = ~0u;
    void estimateRarity(std::span<const uint32_t> cells, float samplesPerPixel);
    void addRareLight(std::span<const RareSample> samples);
    HugeVector<Rest> estimateLight();
    void addRests(std::span<Rest> rests);
    bool limitSpread(std::span<const Rest> rests);
    float otherLightAround(uint32_t cell) const;
    uint32_t topOf(uint32_t cell) const;
    std::vector<bool> findTopsNearRareLight() const;

    const CellPyramid& m_pyramid;
    const std::span<const uint32_t> m_cellsByNode;
    const LightPart m_part;
    HugeVector<Estimate>& m_estimates;
    BrightRegions m_regions;
    std::vector<uint32_t> m_groupOf; ///< by cell; kNone: no samples
    std::vector<Group> m_groups;
    std::vector<bool> m_hasRareLight; ///< by node
};

RareLight::RareLight(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                     std::span<const PixelRareSample> samples, LightPart part, float samplesPerPixel) {
    std::vector<RareSample> ofPart;
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(ofPart),
                 [&](const RareSample& sample) { return LightPart(sample.part) == part; });
    if (ofPart.empty())
        return;
    m_estimates.resize(pyramid.cellCount());
    Estimator(pyramid, cellsByNode, ofPart, part, samplesPerPixel, m_estimates);
}

RareLight::Estimator::Estimator(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
                                std::span<const RareSample> samples, LightPart part, float samplesPerPixel,
                                HugeVector<Estimate>& estimates)
    : m_pyramid(pyramid), m_cellsByNode(cellsByNode), m_part(part), m_estimates(estimates),
      m_regions(pyramid), m_groupOf(estimates.size(), kNone), m_hasRareLight(pyramid.nodes().size()) {
    for (const RareSample& sample : samples) {
        const float brightness = sum(sample.light);
        m_regions.addTo(sample.cell, [&](BrightSums& sums, int) {
            sums.brightness += brightness;
            sums.squares += sqr(brightness);
        });
        m_groupOf[sample.cell] = 0;
    }
    std::vector<uint32_t> cells;
    for (const uint32_t cell : cellsByNode)
        if (m_groupOf[cell] != kNone) {
            m_groupOf[cell] = uint32_t(cells.size());
            cells.push_back(cell);
        }
    m_groups.resize(cells.size());
    estimateRarity(cells, samplesPerPixel);
    addRareLight(samples);
    if (limitSpread(estimateLight())) {
        for (Estimate& estimate : m_estimates)
            estimate.light = Rgb(0);
        addRareLight(samples);
        estimateLight();
    }
}

/// Sets the rarity of the cells with samples by the number of equally bright samples around them, and the
/// weights of their groups.
void RareLight::Estimator::estimateRarity(std::span<const uint32_t> cells, float samplesPerPixel) {
    HugeVector<float> densities(cells.size()); // of equally bright samples
    m_regions.forEach(cells, BrightRegions::Extent::All, [&](uint32_t cell, const BrightRegion& region) {
        densities[m_groupOf[cell]] +=
            (region.weight + region.rest) * region.sums.effectiveCount() / region.count;
        m_groups[m_groupOf[cell]].set(region);
    });
    // A highlight may be a part of the smallest region only.
    constexpr float kByChance = 2; // samples that come together in a core
    parallelForRuns(cells.size(), [&](size_t i) {
        m_groups[i].setWeights(m_regions.largestSize(cells[i]));
        const BrightRegion core = m_regions.coreOf(cells[i]);
        const float inCore = (core.sums.effectiveCount() - kByChance) / core.count;
        m_estimates[cells[i]].rarity = rarityOf(samplesPerPixel * std::max(densities[i], inCore));
    });
}

/// Adds the rare light of the samples to the regions. Only the samples that have weight in regions of a size
/// count there: those of a highlight do not light its surroundings.
void RareLight::Estimator::addRareLight(std::span<const RareSample> samples) {
    m_regions.clear();
    for (const RareSample& sample : samples) {
        const Estimate& estimate = m_estimates[sample.cell];
        const float brightness = sum(sample.light), rarity = estimate.rarity * estimate.spread;
        const Group& group = m_groups[m_groupOf[sample.cell]];
        m_regions.addTo(sample.cell, [&](BrightSums& sums, int size) {
            const float weight = group.weight(size);
            sums.brightness += weight * brightness;
            sums.squares += weight * sqr(brightness);
            sums.rare += sample.light * (weight * rarity);
        });
        if (rarity > 0)
            m_pyramid.forEachAncestor(m_pyramid.nodeOf(sample.cell),
                                      [&](uint32_t node) { m_hasRareLight[node] = true; });
    }
}

/// Adds the light of the cells that have rare light around them. Returns, by cell, the largest regions as far
/// as their light is that of few samples, and that of no other surfaces.
HugeVector<Rest> RareLight::Estimator::estimateLight() {
    const std::vector<bool> isNearRare = findTopsNearRareLight();
    std::vector<uint32_t> cells;
    std::copy_if(m_cellsByNode.begin(), m_cellsByNode.end(), std::back_inserter(cells),
                 [&](uint32_t cell) { return isNearRare[topOf(cell)]; });
    HugeVector<Rest> rests(m_estimates.size());
    m_regions.forEach(cells, BrightRegions::Extent::Enough, [&](uint32_t cell, const BrightRegion& region) {
        const Rgb light = region.sums.rare * (1 / region.count);
        m_estimates[cell].light += light * region.weight;
        rests[cell] = {region.rest, light};
    });
    addRests(rests);
    return rests;
}

/// Adds the light of the weights that are left. A surface whose largest region has not enough samples has at
/// most the mean of all such surfaces, if they are enough: a single bright sample would light a small
/// surface. Surfaces with less keep their own: the mean would brighten dark surfaces next to bright ones.
/// The weights become those of light that is not such a mean.
void RareLight::Estimator::addRests(std::span<Rest> rests) {
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
    for (size_t cell = 0; cell < rests.size(); ++cell) {
        const Rgb& own = rests[cell].light;
        const Rgb light = sum(own) > sum(mean) ? mean * common + own * (1 - common) : own;
        m_estimates[cell].light += light * rests[cell].weight;
        rests[cell].weight *= 1 - common;
    }
}

/// Sets Estimate::spread of the cells with samples. Returns whether it is less than 1 anywhere. One sample
/// out of thousands may be so bright that it would make a whole wall white, in one of many images. A single
/// sample says little about the wall. Where its light exceeds the limits of kCredible and kDark, the fraction
/// that is spread falls with the square of its brightness.
bool RareLight::Estimator::limitSpread(std::span<const Rest> rests) {
    bool isLimited = false;
    for (uint32_t cell = 0; cell < rests.size(); ++cell) {
        const Rest& rest = rests[cell];
        if (m_groupOf[cell] == kNone || !(rest.weight > 0))
            continue;
        const float light = rest.weight * sum(rest.light);
        const float most = std::max(kCredible * otherLightAround(cell), kDark);
        if (light > most) {
            m_estimates[cell].spread = 1 - rest.weight * (1 - sqr(most / light));
            isLimited = true;
        }
    }
    return isLimited;
}

/// Returns the mean of the part's other light in a node as large as those of the largest region around a
/// cell; sum of the channels.
float RareLight::Estimator::otherLightAround(uint32_t cell) const {
    uint32_t index = m_pyramid.nodeOf(cell);
    for (int size = 0; size < m_regions.largestSize(cell); ++size)
        index = m_pyramid.nodes()[index].parent;
    const CellNode& node = m_pyramid.nodes()[index];
    const NodeLight& light = m_pyramid.light(m_part, index);
    float total = 0;
    for (int c = 0; c < NodeLight::kChannels; ++c)
        total += node.count[c / 3] * light.of[c];
    return total / (node.count[0] + node.count[1]);
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
                            [&](uint32_t node) { return bool(m_hasRareLight[node]); }))
                found[run].push_back(top);
        }
    });
    std::vector<bool> out(m_pyramid.nodes().size());
    for (const auto& ofRun : found)
        for (const uint32_t top : ofRun)
            out[top] = true;
    return out;
}

void addCommonLight(const RareLight (&rare)[kParts], RecordedLight& light, CellPyramid& pyramid) {
    std::optional<Highlights> highlights[kParts];
    for (int part = 0; part < kParts; ++part)
        if (!rare[part].isEmpty())
            highlights[part].emplace(light.pixelBounds.width(), light.pixelBounds.height());
    for (const PixelRareSample& sample : light.rare) {
        const Rgb common = sample.albedo * commonOf(sample, rare[sample.part]);
        const float weight = float(light.weights(sample.pixel, int(sample.half)).all);
        highlights[sample.part]->add(sample.pixel, int(sample.half), sum(common) / std::max(weight, 1.f));
    }
    float shared[kParts] = {}; // of the last pixel
    uint32_t last = ~0u;
    for (const PixelRareSample& sample : light.rare) {
        if (std::exchange(last, sample.pixel) != sample.pixel)
            for (int part = 0; part < kParts; ++part)
                shared[part] = highlights[part] ? 1 - highlights[part]->kept(sample.pixel) : 0;
        const Rgb common = commonOf(sample, rare[sample.part]) * shared[sample.part];
        pyramid.addLight(sample.cell, LightPart(sample.part), int(sample.half), common);
        HalfPart& sums = light.light(LightPart(sample.part), sample.pixel, int(sample.half));
        sums.light += sample.albedo * common;
        if (sample.isInQuarter)
            sums.quarterLight += sample.albedo * common;
    }
}

} // namespace strobe
