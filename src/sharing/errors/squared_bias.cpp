#include "sharing/errors/squared_bias.h"

#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

SquaredBias::SquaredBias(int width, int height, float sigma)
    : m_sigma(sigma), m_means(width, height), m_squaredErrors(width, height),
      m_wideMeans(blocksAlong(width, kCoarse), blocksAlong(height, kCoarse)),
      m_wideSquaredErrors(m_wideMeans.width, m_wideMeans.height) {}

void SquaredBias::average(const BrightPixels& bright, LanePlane& scratch) {
    // The squares of the weights of a Gaussian window are the weights of a window that is narrower by
    // sqrt(2), apart from a factor: their sum.
    const float sigmaOfSquares = m_sigma / std::sqrt(2.f);
    const WindowMean window(m_means.width, m_means.height, m_sigma),
        windowOfSquares(m_means.width, m_means.height, sigmaOfSquares);
    const BrightMeans means(m_means, window, bright), squaredErrors(m_squaredErrors, windowOfSquares, bright);
    means.fade(m_means);
    squaredErrors.fade(m_squaredErrors);
    averageWide(sigmaOfSquares);
    window.apply(m_means, scratch);
    windowOfSquares.apply(m_squaredErrors, scratch);
    means.write(m_means);
    squaredErrors.write(m_squaredErrors);
    for (const BrightPixels::Pixel& pixel : bright.all()) {
        // The means over wide windows are those of pixels that are not bright. Bias grows with the
        // brightness.
        const float scale = 1 / std::sqrt(pixel.weight);
        set(pixel.index, estimate(pixel.index, scale), Float4{});
    }
}

/// Sets m_wideMeans and m_wideSquaredErrors from the products.
void SquaredBias::averageWide(float sigmaOfSquares) {
    const int width = m_wideMeans.width, height = m_wideMeans.height;
    LanePlane scratch(width, height);
    averageBlocks();
    limitBlocks(scratch);
    WindowMean(width, height, m_sigma).apply(m_wideMeans, scratch);
    WindowMean(width, height, sigmaOfSquares).apply(m_wideSquaredErrors, scratch);
}

/// Sets m_wideMeans to the means of the products by block, and m_wideSquaredErrors to their expected squared
/// errors.
void SquaredBias::averageBlocks() {
    parallelFor(size_t(m_wideMeans.height), [&](size_t row) {
        const int y0 = kCoarse * int(row), y1 = std::min(y0 + kCoarse, m_means.height);
        for (int block = 0; block < m_wideMeans.width; ++block) {
            const int x0 = kCoarse * block, x1 = std::min(x0 + kCoarse, m_means.width);
            Float4 sum = {}, squaredErrors = {};
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x) {
                    sum += loadFloat4(m_means.row(y) + LanePlane::kLanes * x);
                    squaredErrors += loadFloat4(m_squaredErrors.row(y) + LanePlane::kLanes * x);
                }
            const float inverse = 1 / float((y1 - y0) * (x1 - x0));
            storeFloat4(m_wideMeans.row(int(row)) + LanePlane::kLanes * block, sum * inverse);
            storeFloat4(m_wideSquaredErrors.row(int(row)) + LanePlane::kLanes * block,
                        squaredErrors * sqr(inverse));
        }
    });
}

/// Limits the means of blocks that are not significant to a multiple of the mean of absolute values around
/// them, so that rare bright samples of a single block do not decide.
void SquaredBias::limitBlocks(LanePlane& scratch) {
    constexpr float kMultiple = 5;       // a 16th of the blocks of the window reach it together
    constexpr float kSignificant = 1.5f; // standard errors: more than those of two rare pixels
    LanePlane sizes(m_wideMeans.width, m_wideMeans.height);
    auto& means = m_wideMeans.values;
    parallelForRuns(means.size(), [&](size_t i) { sizes.values[i] = std::abs(means[i]); });
    WindowMean(sizes.width, sizes.height, m_sigma).apply(sizes, scratch);
    parallelForRuns(means.size(), [&](size_t i) {
        if (means[i] > 0 && sqr(means[i]) > sqr(kSignificant) * m_wideSquaredErrors.values[i])
            return;
        const float limit = kMultiple * sizes.values[i];
        means[i] = std::clamp(means[i], -limit, limit);
    });
}

/// Returns the values of a plane of blocks at a pixel.
Float4 SquaredBias::interpolate(const LanePlane& plane, size_t pixel) const {
    return interpolateBlocks(plane, int(pixel) % m_means.width, int(pixel) / m_means.width, kCoarse);
}

/// Returns the estimates at a pixel, with `scaleOfWide` times the means over the wide window.
Float4 SquaredBias::estimate(size_t pixel, float scaleOfWide) const {
    // Means below `least` standard errors do not count, those of twice as many count by 15/16.
    constexpr float kLeast = 2, kLeastAlone = 3, kSignificantAround = 1, kTiny = 1e-30f;
    const float squaredWeights = WindowMean::squaredWeights(m_sigma);
    const Float4 zero = {};
    const Float4 wide = scaleOfWide * interpolate(m_wideMeans, pixel),
                 wideSquaredError =
                     sqr(scaleOfWide) * squaredWeights * interpolate(m_wideSquaredErrors, pixel);
    const auto isAround = (wide > zero) & (wide * wide > sqr(kSignificantAround) * wideSquaredError);
    const Float4 least = isAround ? zero + kLeast : zero + kLeastAlone;
    const Float4 mean = loadFloat4(m_means.at(pixel)), squaredError = loadFloat4(m_squaredErrors.at(pixel));
    const Float4 ratio = least * least * squaredWeights * squaredError / (mean * mean + kTiny);
    Float4 rest = ratio * ratio;
    rest = (rest > 1) | ((mean <= zero) & (squaredError > zero)) ? zero + 1 : rest;
    return mean + rest * ((wide > zero ? wide : zero) - mean);
}

} // namespace strobe
