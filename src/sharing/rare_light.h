// Light of rare bright samples, spread over the surface around them.
#pragma once

#include "sharing/cell_pyramid.h"
#include "sharing/records/recorded_light.h"

namespace strobe {

/// Estimates of the light of rare bright samples. Some paths reach a small bright region with a low
/// probability. Their samples are much brighter than their neighbors. A fit that contains such a sample would
/// be a bright spot as large as its region. Therefore, light above RareLimits is recorded by sample
/// (RareSample). For one part of the light, at each cell it is averaged over a region that contains several
/// such samples. Surfaces with few of them have the mean of all such surfaces. A single sample that would
/// make its surface many times as bright is not spread. Samples of a highlight are not rare: each pixel has
/// some. Their light is added to the other light, or stays in its pixels (Highlights). Samples that come
/// together more than chance allows do not light what is far from them.
class RareLight {
  public:
    /// There is no rare light.
    RareLight() = default;
    /// `cellsByNode`: those of the pyramid. `samples`: those of other parts are ignored. `samplesPerPixel`:
    /// mean.
    RareLight(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode,
              std::span<const PixelRareSample> samples, LightPart part, float samplesPerPixel);

    /// Returns whether there is no rare light.
    bool isEmpty() const { return m_estimates.empty(); }
    /// Returns the fraction of the samples' light above the limit that is rare at a recorded cell, in [0,1].
    float rarity(uint32_t cell) const { return isEmpty() ? 0 : m_estimates[cell].rarity; }
    /// Returns the fraction of the rare light of the samples at a recorded cell that is spread, in [0,1]. The
    /// rest stays in their pixels.
    float spread(uint32_t cell) const { return isEmpty() ? 0 : m_estimates[cell].spread; }
    /// Returns the rare light per sample around a recorded cell.
    Rgb light(uint32_t cell) const { return isEmpty() ? Rgb(0) : m_estimates[cell].light; }

  private:
    struct Estimate {
        float rarity = 0, spread = 1;
        Rgb light = Rgb(0);
    };
    class Estimator;
    HugeVector<Estimate> m_estimates; ///< by cell; empty: no rare light
};

/// Adds the light of the samples above RareLimits to the other light of pixels and nodes, as far as it is
/// neither rare nor kept by Highlights. `rare`: by part.
void addCommonLight(const RareLight (&rare)[kParts], RecordedLight& light, CellPyramid& pyramid);

} // namespace strobe
