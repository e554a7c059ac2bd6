#include "sharing/errors/local_means.h"

#include "core/math/simd4.h"

namespace strobe {

namespace {

constexpr int kLanes = LanePlane::kLanes, kLast = kLanes - 1;
constexpr float kTiny = 1e-20f;

int blocksOf(int pixels, int edge) { return (pixels + edge - 1) / edge; }

float sumOfColor(const Float4& v) { return v[0] + v[1] + v[2]; }

/// Calls visit(x, y, i) for the elements of a plane.
template <class Visit>
void forElements(const LanePlane& plane, const Visit& visit) {
    parallelFor(size_t(plane.height), [&](size_t y) {
        for (int x = 0; x < plane.width; ++x)
            visit(x, int(y), y * size_t(plane.width) + size_t(x));
    });
}

/// Returns the values of a plane of blocks at (x, y) of a plane that has twice as many elements per edge,
/// interpolated between the centers of the blocks.
Float4 interpolate(const LanePlane& blocks, int x, int y) {
    const auto position = [](int element, int count) {
        return std::clamp(0.5f * float(element) - 0.25f, 0.f, float(count - 1));
    };
    const float u = position(x, blocks.width), v = position(y, blocks.height);
    const int x0 = int(u), y0 = int(v), x1 = std::min(x0 + 1, blocks.width - 1),
              y1 = std::min(y0 + 1, blocks.height - 1);
    const auto inRow = [&](int row) {
        const float* const values = blocks.row(row);
        const Float4 first = loadFloat4(values + kLanes * x0), second = loadFloat4(values + kLanes * x1);
        return first + (u - float(x0)) * (second - first);
    };
    const Float4 above = inRow(y0), below = inRow(y1);
    return above + (v - float(y0)) * (below - above);
}

constexpr float kWindow = 1, kWindowOfProducts = 2; // standard deviations in blocks

/// Means over a window, by lane: of x d as the halves of means over narrower windows show it, of d^2, of x d
/// as the halves of single pixels show it, and sums of the squares of the latter.
enum ProductLane { kOfHalves, kOfDifference, kOfPixels, kOfSquares };

/// Returns these products of blocks, whose sums became means over windows.
Float4 productsOf(const Float4& difference, const Float4& halves) {
    constexpr float kSquaredWeights = 1 / (4 * 3.14159265f * kWindow * kWindow); // of a window
    // Relative to the deviations, so that bright pixels do not decide for dark ones:
    const float weight = 1 / (sqr(difference[kLast]) + kTiny), ofPixels = weight * kSquaredWeights;
    return Float4{weight * halves[0] * halves[1], weight * sqr(sumOfColor(difference)), ofPixels * halves[2],
                  sqr(ofPixels) * halves[3]};
}

/// Returns the fraction of the differences to correct. A ratio near 1 counts as more: noise of the ratio
/// would add that of own values to smooth light, which gains most.
float fractionOf(const Float4& products) {
    constexpr float kCaution = 2; // 1 gains 1 % more, but loses up to 10 % where light is smooth (measured)
    constexpr float kFewPixels = 6;
    constexpr float kBlocks =
        4 * 3.14159265f * (kWindow * kWindow + kWindowOfProducts * kWindowOfProducts); // of both windows
    const float pixels = kBlocks * sqr(products[kOfPixels]) / (products[kOfSquares] + kTiny);
    const float ofPixels = std::min(kFewPixels / (pixels + kTiny), 1.f) * products[kOfPixels];
    const float ratio = std::max({products[kOfHalves], ofPixels, 0.f}) / (products[kOfDifference] + kTiny);
    return std::max(0.f, 1 - ratio * (1 + kCaution * ratio)); // in this order, not a number becomes 0
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
        const Float4 correction = interpolate(coarser.corrections, x, y);
        storeFloat4(corrections.at(i), correction);
        float *const sums = differences.at(i), deviation = sums[kLast];
        storeFloat4(sums, loadFloat4(sums) - deviation * correction);
        sums[kLast] = deviation;
        halves.at(i)[1] -= deviation * correction[kLast];
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
        difference[kLast] = halves.at(i)[1];
        storeFloat4(corrections.at(i), loadFloat4(corrections.at(i)) + scale * difference);
    });
}

LocalMeans::LocalMeans(int width, int height, bool isIndependent)
    : m_width(width), m_height(height), m_isIndependent(isIndependent) {
    constexpr int kLevels = 4; // blocks of 2 to 16 pixels, whose windows have these standard deviations
    for (int level = 0, edge = kBlock; level < kLevels; ++level, edge *= 2)
        m_levels.emplace_back(blocksOf(width, edge), blocksOf(height, edge));
}

void LocalMeans::addTo(Level& level, int x, int y, const MixedPixel& pixel) const {
    float *const sums = level.differences.row(y) + kLanes * x, *const ofHalves =
                                                                   level.halves.row(y) + kLanes * x;
    for (int c = 0; c < 3; ++c)
        sums[c] += pixel.difference[c];
    sums[kLast] += pixel.deviation;
    ofHalves[0] += pixel.ownHalves;
    ofHalves[1] += pixel.differenceHalves;
    if (m_isIndependent) {
        const float product = pixel.ownHalves * pixel.differenceHalves;
        ofHalves[2] += product;
        ofHalves[3] += sqr(product);
    }
}

void LocalMeans::correctLevels() {
    for (size_t i = 1; i < m_levels.size(); ++i)
        m_levels[i].addBlocksOf(m_levels[i - 1]);
    for (size_t i = m_levels.size(); i-- > 0;)
        m_levels[i].correct(i + 1 < m_levels.size() ? &m_levels[i + 1] : nullptr);
}

Rgb LocalMeans::correction(size_t pixel) const {
    static_assert(kBlock == 2, "interpolate expects twice as many elements per edge");
    const Float4 at = interpolate(m_levels.front().corrections, int(pixel) % m_width, int(pixel) / m_width);
    return {at[0], at[1], at[2]};
}

} // namespace strobe
