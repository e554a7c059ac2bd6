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
    // Differences between the two halves of the samples, summed over the channels. They are scaled: the
    // expected square is the variance of the mean of both halves.
    float ownHalves = 0;        ///< of the own values
    float differenceHalves = 0; ///< of the values of `difference`
};

/// Corrects a bias that neighboring pixels have in common. Shared estimates have little noise, but such a
/// bias. Over a window of pixels, the noise of own values averages out, and the bias remains. The correction
/// of a window is a fraction of the mean difference between own values and mixture. Windows have standard
/// deviations of 16, 8, 4 and 2 pixels, in this order. Each corrects what the wider ones left. The pixels of
/// a window share its correction in proportion to their deviations.
///
/// Let x be the noise of the mean own value of a window, and d the difference of this mean from that of the
/// mixture. The fraction 1 - E[x d] / E[d^2] leaves the least squared error. It is that of the estimator of
/// James and Stein (1961), but the target depends on the own values. The halves of the samples are
/// independent. Therefore E[x d] follows from the difference of x and that of d between the halves: their
/// product estimates it.
///
/// A bright sample in each half can cancel in the difference of x by chance. The correction would then be a
/// bright spot. Where few pixels have most of the noise, and the noise of pixels is independent, the estimate
/// is therefore at least the sum of the products of single pixels.
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
        LanePlane halves; ///< ownHalves, differenceHalves; if noise is independent, their product, its square
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
