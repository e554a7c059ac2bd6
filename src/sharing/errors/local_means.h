// The means of a mixture over windows of pixels, corrected towards those of the pixels' own values.
#pragma once

#include "core/math/math.h"
#include "core/util/parallel.h"
#include "sharing/errors/window_mean.h"

#include <algorithm>
#include <vector>

namespace strobe {

/// A pixel's mixture of its own value and of shared estimates, beside the own value.
struct MixedPixel {
    Rgb difference = Rgb(0); ///< the own value minus the mixture
    float deviation = 0;     ///< the expected error of the mixture
    // What the two halves of the samples differ in, sums over the channels, scaled such that the expected
    // square is the variance of the mean over both halves:
    float ownHalves = 0;        ///< of the own value
    float differenceHalves = 0; ///< of `difference`
};

/// Shared estimates have little noise, but a bias that neighboring pixels have in common. Over a window of
/// pixels, the noise of own values averages out and this bias does not. LocalMeans corrects the mixture by a
/// fraction of the mean difference from the own values: over windows of 16 pixels, then of 8, 4 and 2
/// (standard deviations), each for what the wider ones left. Pixels share a correction in proportion to their
/// deviations.
///
/// With x, the noise of the mean own value, and d, its difference from that of the mixture, the fraction that
/// leaves the least squared error is 1 - E[x d] / E[d^2]: that of the estimator of James and Stein (1961),
/// with a target that depends on the own values. The halves of the samples are independent, so that the
/// product of what they differ in shows E[x d]. Where few pixels have most of the noise, bright samples of
/// both halves cancel in this product by chance, and would leave a bright spot. If the noise of pixels is
/// independent, it therefore counts at least as much there as the products of single pixels show.
class LocalMeans {
  public:
    /// `isIndependent`: whether the noise of pixels is.
    LocalMeans(int width, int height, bool isIndependent);
    /// Calls mix(pixel), which returns its MixedPixel, for all pixels, and computes the corrections.
    template <class Mix>
    void compute(const Mix& mix) {
        Level& finest = m_levels.front();
        parallelFor(size_t(finest.differences.height), [&](size_t row) {
            const int y0 = kBlock * int(row), y1 = std::min(y0 + kBlock, m_height);
            for (int y = y0; y < y1; ++y)
                for (int x = 0; x < m_width; ++x)
                    addTo(finest, x / kBlock, int(row), mix(size_t(y) * size_t(m_width) + size_t(x)));
        });
        correctLevels();
    }
    /// Returns the correction of a pixel relative to its deviation.
    Rgb correction(size_t pixel) const;

  private:
    static constexpr int kBlock = 2; ///< pixels per edge of a block of the finest level

    /// The sums over blocks of pixels of one size, and the corrections of all levels from the coarsest to
    /// this one.
    struct Level {
        LanePlane differences; ///< the last lane: of the deviations
        LanePlane halves;      ///< ownHalves, differenceHalves, their product if it counts, its square
        LanePlane corrections; ///< relative to the deviation; the last lane: of differenceHalves
        Level(int width, int height);
        void addBlocksOf(const Level& finer);
        void correct(const Level* coarser);
        void takeCorrections(const Level& coarser);
    };
    void addTo(Level& level, int x, int y, const MixedPixel& pixel) const;
    void correctLevels();

    const int m_width, m_height;
    const bool m_isIndependent;
    std::vector<Level> m_levels; ///< from the finest; each has blocks twice as wide as the one before
};

} // namespace strobe
