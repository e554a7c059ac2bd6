#include "sharing/squared_bias.h"

#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

namespace {

int blocksOf(int pixels, int edge) { return (pixels + edge - 1) / edge; }

/// The position of a pixel between the centers of two blocks.
struct BlockPosition {
    int first, second;
    float fraction; ///< towards `second`

    BlockPosition(int pixel, int edge, int count) {
        const float position = std::clamp((float(pixel) + 0.5f) / float(edge) - 0.5f, 0.f, float(count - 1));
        first = int(position);
        second = std::min(first + 1, count - 1);
        fraction = position - float(first);
    }
};

} // namespace

SquaredBias::SquaredBias(int width, int height, float sigma)
    : m_sigma(sigma), m_means(width, height), m_squaredErrors(width, height),
      m_wideMeans(blocksOf(width, kCoarse), blocksOf(height, kCoarse)) {}

void SquaredBias::average(LanePlane& scratch) {
    const WindowMean wide(m_wideMeans.width, m_wideMeans.height, m_sigma);
    LanePlane wideScratch(m_wideMeans.width, m_wideMeans.height);
    limitBlocks(averageBlocks(), wide, wideScratch);
    wide.apply(m_wideMeans, wideScratch);
    WindowMean(m_means.width, m_means.height, m_sigma).apply(m_means, scratch);
    // The squares of the weights of a Gaussian window are the weights of a window that is narrower by
    // sqrt(2), apart from a factor: their sum.
    WindowMean(m_means.width, m_means.height, m_sigma / std::sqrt(2.f)).apply(m_squaredErrors, scratch);
}

/// Sets m_wideMeans to the means of the products by block. Returns their expected squared errors.
LanePlane SquaredBias::averageBlocks() {
    LanePlane errors(m_wideMeans.width, m_wideMeans.height);
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
            storeFloat4(errors.row(int(row)) + LanePlane::kLanes * block, squaredErrors * sqr(inverse));
        }
    });
    return errors;
}

/// Limits the means of blocks that are not significant to a multiple of the mean of absolute values around
/// them, so that rare bright samples of a single block do not decide.
void SquaredBias::limitBlocks(const LanePlane& squaredErrors, const WindowMean& wide, LanePlane& scratch) {
    constexpr float kMultiple = 5;       // a 16th of the blocks of the window reach it together
    constexpr float kSignificant = 1.5f; // standard errors: more than those of two rare pixels
    LanePlane sizes(m_wideMeans.width, m_wideMeans.height);
    auto& means = m_wideMeans.values;
    parallelForRuns(means.size(), [&](size_t i) { sizes.values[i] = std::abs(means[i]); });
    wide.apply(sizes, scratch);
    parallelForRuns(means.size(), [&](size_t i) {
        if (means[i] > 0 && sqr(means[i]) > sqr(kSignificant) * squaredErrors.values[i])
            return;
        const float limit = kMultiple * sizes.values[i];
        means[i] = std::clamp(means[i], -limit, limit);
    });
}

/// Returns the means over the wide window at a pixel.
Float4 SquaredBias::wideMean(int x, int y) const {
    const BlockPosition u(x, kCoarse, m_wideMeans.width), v(y, kCoarse, m_wideMeans.height);
    const auto at = [&](int row) {
        const float* blocks = m_wideMeans.row(row);
        const Float4 first = loadFloat4(blocks + LanePlane::kLanes * u.first),
                     second = loadFloat4(blocks + LanePlane::kLanes * u.second);
        return first + u.fraction * (second - first);
    };
    const Float4 above = at(v.first), below = at(v.second);
    return above + v.fraction * (below - above);
}

Float4 SquaredBias::at(size_t pixel) const {
    // Means below two standard errors do not count, those of four count by 15/16.
    constexpr float kLeast = 2, kPi = 3.14159265f, kTiny = 1e-30f;
    const float squaredWeights = 1 / (4 * kPi * sqr(m_sigma));
    const Float4 zero = {};
    const Float4 mean = loadFloat4(m_means.at(pixel)), squaredError = loadFloat4(m_squaredErrors.at(pixel));
    const Float4 ratio = sqr(kLeast) * squaredWeights * squaredError / (mean * mean + kTiny);
    Float4 rest = ratio * ratio;
    rest = (rest > 1) | ((mean <= zero) & (squaredError > zero)) ? zero + 1 : rest;
    const Float4 wide = wideMean(int(pixel) % m_means.width, int(pixel) / m_means.width);
    return mean + rest * ((wide > zero ? wide : zero) - mean);
}

} // namespace strobe
