// Light of rare bright samples, spread over the surface around them.
#pragma once

#include "sharing/cell_pyramid.h"
#include "sharing/records/recorded_light.h"

namespace strobe {

/// Estimates of the light of rare bright samples. Some paths reach a small bright region with a low
/// probability. Their samples are much brighter than their neighbors. A fit that contains such a sample would
/// be a bright spot as large as its region. Therefore, light above RareLimits is recorded by sample
/// (RareSample). At each cell it is averaged over a region that contains several such samples. Samples of a
/// highlight are not rare: each pixel has some. Their light is added to the other light.
class RareLight {
  public:
    /// `samplesPerPixel`: mean.
    RareLight(const CellPyramid& pyramid, std::span<const PixelRareSample> samples, float samplesPerPixel);

    /// Returns the fraction of the samples' light above the limit that is rare at a recorded cell, in [0,1].
    float rarity(uint32_t cell, int part) const { return m_estimates[kParts * cell + size_t(part)].rarity; }
    /// Returns the rare light per sample around a recorded cell.
    const Rgb& light(uint32_t cell, int part) const {
        return m_estimates[kParts * cell + size_t(part)].light;
    }

  private:
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
    struct Estimate {
        float rarity = 0;
        Rgb light = Rgb(0);
    };
    class Surroundings;
    template <class Work>
    void forNodesOf(const RareSample& sample, const Work& work);
    template <class Work>
    void forRegions(std::span<const uint32_t> cells, const Work& work) const;
    template <class Work>
    void forRegionsOfRun(std::span<const uint32_t> cells, const Work& work) const;
    bool hasMore(uint32_t node, int part) const;
    void estimateRarity(std::span<const PixelRareSample> samples, std::span<const uint32_t> cellsByNode,
                        float samplesPerPixel);
    void estimateLight(std::span<const uint32_t> cellsByNode);
    uint32_t topOf(uint32_t cell) const;
    std::vector<bool> findTopsNearRareLight() const;

    const CellPyramid& m_pyramid;
    HugeVector<Sums> m_sums;          ///< by node, by part
    HugeVector<Estimate> m_estimates; ///< by cell, by part
};

} // namespace strobe
