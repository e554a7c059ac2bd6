#include "sharing/errors/local_means.h"

namespace strobe {

namespace {

constexpr int kLanes = LanePlane::kLanes, kLast = kLanes - 1;
constexpr float kTiny = 1e-20f;

float sumOfColor(const Float4& v) { return v[0] + v[1] + v[2]; }

/// Calls visit(x, y, i) for the elements of a plane.
template <class Visit>
void forElements(const LanePlane& plane, const Visit& visit) {
    parallelFor(size_t(plane.height), [&](size_t y) {
        for (int x = 0; x < plane.width; ++x)
            visit(x, int(y), y * size_t(plane.width) + size_t(x));
    });
}

constexpr float kWindow = 1, kWindowOfProducts = 2; // standard deviations in blocks

/// The lanes of LocalMeans::Level::halves.
enum HalvesLane { kOwnHalves, kDifferenceHalves, kPixelProduct, kSquaredPixelProduct };

/// The lanes of the products of a block. x and d: see LocalMeans.
enum ProductLane {
    kByWindows,      ///< x d, from the halves of the means over the window
    kDifference,     ///< d^2
    kByPixels,       ///< x d, from the halves of each pixel, for independent noise
    kSquaredByPixels ///< sum of the squares of the addends of kByPixels
};

/// Returns the products of a block by ProductLane. `difference`, `halves`: means over the window around it.
Float4 productsOf(const Float4& difference, const Float4& halves) {
    // Relative to the deviations, so that bright pixels do not decide for dark ones:
    const float weight = 1 / (sqr(difference[kLast]) + kTiny),
                ofPixels = weight * WindowMean::squaredWeights(kWindow);
    return Float4{weight * halves[kOwnHalves] * halves[kDifferenceHalves],
                  weight * sqr(sumOfColor(difference)), ofPixels * halves[kPixelProduct],
                  sqr(ofPixels) * halves[kSquaredPixelProduct]};
}

/// Returns the fraction of the differences to correct, from the mean products around a block. A ratio near 1
/// counts as more: noise of the ratio would add the noise of own values to smooth light, which gains most.
float fractionOf(const Float4& products) {
    constexpr float kCaution = 2;   // 1 gains 1 % more, but loses up to 10 % where light is smooth (measured)
    constexpr float kFewPixels = 6; // with more, the halves of windows count more and more alone
    constexpr float kSquaredSigma = kWindow * kWindow + kWindowOfProducts * kWindowOfProducts;
    constexpr float kBlocks = 4 * 3.14159265f * kSquaredSigma; // in the windows of the means
    // The number of equally noisy pixels that would have the same sums:
    const float pixels = kBlocks * sqr(products[kByPixels]) / (products[kSquaredByPixels] + kTiny);
    const float byPixels = std::min(kFewPixels / (pixels + kTiny), 1.f) * products[kByPixels];
    const float ratio = std::max({products[kByWindows], byPixels, 0.f}) / (products[kDifference] + kTiny);
    // If sums overflow, the ratio is not a number, and std::max returns its first argument.
    return std::max(0.f, 1 - ratio * (1 + kCaution * ratio));
}

} // namespace

LocalMeans::Level::Level(int width, int height)
    : differences(width, height), halves(width, height), corrections(width, height) {
    for (LanePlane* const plane : {&differences, &halves, &corrections})
        std::fill(plane->values.begin(), plane->values.end(), 0.f);
}

void LocalMeans::Level::addBlocksOf(const Level& finer) {
    const auto addTo = [&](LanePlane& plane, const LanePlane& blocks, int row, int y) {
        for (int x = 0; x < blocks.width; ++x) {
            float* const sums = plane.row(row) + kLanes * (x / 2);
            storeFloat4(sums, loadFloat4(sums) + loadFloat4(blocks.row(y) + kLanes * x));
        }
    };
    parallelFor(size_t(differences.height), [&](size_t row) {
        for (int y = 2 * int(row); y < std::min(2 * int(row) + 2, finer.differences.height); ++y) {
            addTo(differences, finer.differences, int(row), y);
            addTo(halves, finer.halves, int(row), y);
        }
    });
}

/// Applies the corrections of the next coarser level.
void LocalMeans::Level::takeCorrections(const Level& coarser) {
    forElements(corrections, [&](int x, int y, size_t i) {
        const Float4 correction = interpolateBlocks(coarser.corrections, x, y, 2);
        storeFloat4(corrections.at(i), correction);
        float *const sums = differences.at(i), deviation = sums[kLast];
        storeFloat4(sums, loadFloat4(sums) - deviation * correction);
        sums[kLast] = deviation;
        halves.at(i)[kDifferenceHalves] -= deviation * correction[kLast];
    });
}

/// Computes the corrections. The sums become means over windows. `coarser`: the next level; null: none.
void LocalMeans::Level::correct(const Level* coarser) {
    if (coarser)
        takeCorrections(*coarser);
    LanePlane scratch(differences.width, differences.height);
    const WindowMean window(scratch.width, scratch.height, kWindow);
    window.apply(differences, scratch);
    window.apply(halves, scratch);
    LanePlane products(scratch.width, scratch.height);
    forElements(products, [&](int, int, size_t i) {
        storeFloat4(products.at(i), productsOf(loadFloat4(differences.at(i)), loadFloat4(halves.at(i))));
    });
    WindowMean(scratch.width, scratch.height, kWindowOfProducts).apply(products, scratch);
    forElements(products, [&](int, int, size_t i) {
        Float4 difference = loadFloat4(differences.at(i));
        const float scale = fractionOf(loadFloat4(products.at(i))) / (difference[kLast] + kTiny);
        difference[kLast] = halves.at(i)[kDifferenceHalves];
        storeFloat4(corrections.at(i), loadFloat4(corrections.at(i)) + scale * difference);
    });
}

LocalMeans::LocalMeans(int width, int height, bool isIndependent)
    : m_width(width), m_height(height), m_isIndependent(isIndependent) {
    constexpr int kLevels = 4; // blocks of 2 to 16 pixels, whose windows have these standard deviations
    for (int level = 0, edge = kBlock; level < kLevels; ++level, edge *= 2)
        m_levels.emplace_back(blocksAlong(width, edge), blocksAlong(height, edge));
}

void LocalMeans::addTo(Level& level, int x, int y, const MixedPixel& pixel) const {
    float *const sums = level.differences.row(y) + kLanes * x, *const ofHalves =
                                                                   level.halves.row(y) + kLanes * x;
    for (int c = 0; c < 3; ++c)
        sums[c] += pixel.difference[c];
    sums[kLast] += pixel.deviation;
    ofHalves[kOwnHalves] += pixel.ownHalves;
    ofHalves[kDifferenceHalves] += pixel.differenceHalves;
    if (m_isIndependent) {
        const float product = pixel.ownHalves * pixel.differenceHalves;
        ofHalves[kPixelProduct] += product;
        ofHalves[kSquaredPixelProduct] += sqr(product);
    }
}

void LocalMeans::correctLevels() {
    for (size_t i = 1; i < m_levels.size(); ++i)
        m_levels[i].addBlocksOf(m_levels[i - 1]);
    for (size_t i = m_levels.size(); i-- > 0;)
        m_levels[i].correct(i + 1 < m_levels.size() ? &m_levels[i + 1] : nullptr);
}

Rgb LocalMeans::correction(size_t pixel) const {
    const Float4 at =
        interpolateBlocks(m_levels.front().corrections, int(pixel) % m_width, int(pixel) / m_width, kBlock);
    return {at[0], at[1], at[2]};
}

} // namespace strobe
