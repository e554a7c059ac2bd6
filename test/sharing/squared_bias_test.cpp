#include "core/math/hash.h"
#include "sharing/errors/squared_bias.h"

#include <gtest/gtest.h>

#include <functional>

using namespace strobe;

namespace {

constexpr int kSize = 64;
constexpr float kSigma = 2.5f;

/// A product and its squared error.
struct Product {
    float value, squaredError;
};

/// Returns the estimate at a pixel, from the products of all pixels.
float estimateAt(int x, int y, const std::function<Product(int, int)>& product) {
    SquaredBias bias(kSize, kSize, kSigma);
    for (int v = 0; v < kSize; ++v)
        for (int u = 0; u < kSize; ++u) {
            const Product p = product(u, v);
            bias.set(size_t(v * kSize + u), Float4{} + p.value, Float4{} + p.squaredError);
        }
    LanePlane scratch(kSize, kSize);
    bias.average(BrightPixels(std::vector<Brightness>(size_t(kSize * kSize)), kSize, kSize), scratch);
    return bias.at(size_t(y * kSize + x))[0];
}

/// Returns 1 or -1 by pixel.
float randomSign(int x, int y) { return hashOf(uint64_t(x), uint64_t(y)) & 1 ? 1.f : -1.f; }

TEST(SquaredBias, IsThatOfAConstant) {
    EXPECT_NEAR(estimateAt(30, 30, [](int, int) { return Product{2, 0}; }), 2, 1e-5);
    // 78 pixels of the window reduce the error of 1 to 0.11, far below the mean.
    EXPECT_NEAR(estimateAt(30, 30, [](int, int) { return Product{2, 1}; }), 2, 1e-3);
    EXPECT_NEAR(estimateAt(0, 63, [](int, int) { return Product{2, 1}; }), 2, 1e-3);
}

TEST(SquaredBias, IsNotThatOfARareBrightPixel) {
    const auto noise = [](int x, int y) { return Product{randomSign(x, y), 1}; };
    const auto withBright = [&](int x, int y) {
        return x == 30 && y == 30 ? Product{1e4f, 1e8f} : noise(x, y);
    };
    // A Gaussian window alone would give 1e4 / 39 = 255.
    EXPECT_LT(estimateAt(30, 30, withBright), 5);
    EXPECT_LT(estimateAt(33, 31, withBright), 5);
}

TEST(SquaredBias, KeepsThatOfFewPixelsThatAreCertain) {
    // The bias of a line, as of the edge of a shadow: 1 / (sqrt(2 pi) sigma) of the weights are on it.
    const auto line = [](int x, int y) { return x == 30 ? Product{100, 10} : Product{randomSign(x, y), 1}; };
    EXPECT_NEAR(estimateAt(30, 30, line), 100 / (std::sqrt(2 * 3.14159f) * kSigma), 1);
    // Far from it, there is none.
    EXPECT_LT(estimateAt(60, 30, line), 1);
}

TEST(SquaredBias, ComesFromAWideWindowWhereTheNarrowOneHasNoise) {
    // A bias of 0.5 below noise of 4: one window does not show it, a window of 16 times as many pixels does.
    const auto noise = [](int x, int y) { return Product{0.5f + 4 * randomSign(x, y), 16}; };
    double sum = 0;
    int count = 0;
    for (int y = 16; y < 48; y += 4)
        for (int x = 16; x < 48; x += 4, ++count)
            sum += double(estimateAt(x, y, noise));
    EXPECT_NEAR(sum / count, 0.5, 0.2);
}

TEST(SquaredBias, MustBeMoreSignificantWhereItIsAlone) {
    // The mean over the window around the patch is 0.3: 2.7 standard errors.
    const auto patch = [](float around) {
        return [=](int x, int y) {
            return Product{std::max(std::abs(x - 30), std::abs(y - 30)) <= 2 ? 0.55f : around, 1};
        };
    };
    EXPECT_LT(estimateAt(30, 30, patch(0)), 0.1f);
    // That over the wide window is 0.02, then 0.07: 0.8 and 2.5 standard errors.
    EXPECT_GT(estimateAt(30, 30, patch(0.05f)), 0.15f);
}

TEST(SquaredBias, IsNeverNegativeWhereErrorsAreKnown) {
    for (const float value : {-3.f, 0.f})
        EXPECT_EQ(estimateAt(20, 20, [&](int, int) { return Product{value, 1}; }), 0);
}

} // namespace
