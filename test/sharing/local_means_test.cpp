#include "core/math/hash.h"
#include "sharing/errors/local_means.h"

#include <gtest/gtest.h>

using namespace strobe;

namespace {

constexpr int kSize = 64;

/// Returns one of two random numbers by pixel, with mean 0 and variance 1.
float randomNumber(size_t pixel, int k) {
    return (float(hashOf(uint64_t(pixel), uint64_t(k)) >> 40) / float(1 << 24) - 0.5f) * std::sqrt(12.f);
}

/// The noise of an own value whose two halves are independent. The mean over both has a variance of 1.
struct Noise {
    float mean, halves;
    explicit Noise(size_t pixel)
        : mean((randomNumber(pixel, 0) + randomNumber(pixel, 1)) / std::sqrt(2.f)),
          halves((randomNumber(pixel, 0) - randomNumber(pixel, 1)) / std::sqrt(2.f)) {}
};

/// Returns a gray pixel whose mixture has no noise and this bias. `noise`: the scale of that of the own
/// value.
MixedPixel mixedPixel(size_t pixel, float noise, float bias) {
    const Noise own(pixel);
    return {Rgb(noise * own.mean - bias), 1, 3 * noise * own.halves, 3 * noise * own.halves};
}

/// Returns the corrections of a gray image with the pixels mix(pixel).
template <class Mix>
std::vector<float> corrections(const Mix& mix, int width = kSize, int height = kSize) {
    LocalMeans means(width, height, true);
    means.compute(mix);
    std::vector<float> out;
    for (size_t i = 0; i < size_t(width) * size_t(height); ++i)
        out.push_back(means.correction(i).x);
    return out;
}

/// Returns the mean square of values + offset.
double meanSquare(const std::vector<float>& values, float offset = 0) {
    double sum = 0;
    for (const float v : values)
        sum += sqr(double(v + offset));
    return sum / double(values.size());
}

TEST(LocalMeans, RemoveBiasThatPixelsHaveInCommon) {
    // The squared bias is 1. The mean of own values over a window of 2 pixels has a variance of 0.02.
    const auto corrected = corrections([](size_t i) { return mixedPixel(i, 1, 1); });
    EXPECT_LT(meanSquare(corrected, 1), 0.05);
}

TEST(LocalMeans, RemoveBiasOfARegion) {
    const auto isBiased = [](size_t i) { return i % kSize < 24 && i / kSize < 24; };
    const auto corrected =
        corrections([&](size_t i) { return mixedPixel(i, 0.5f, isBiased(i) ? 1.f : 0.f); });
    double inside = 0, outside = 0;
    for (size_t i = 0; i < corrected.size(); ++i)
        (isBiased(i) ? inside : outside) += sqr(double(corrected[i] + (isBiased(i) ? 1.f : 0.f)));
    EXPECT_LT(inside / (24 * 24), 0.15);
    EXPECT_LT(outside / (kSize * kSize - 24 * 24), 0.05);
}

TEST(LocalMeans, KeepNoiseOfOwnValuesOut) {
    // Without a bias, the squared error of the mixture is 0. The means of the own values would bring 0.02.
    EXPECT_LT(meanSquare(corrections([](size_t i) { return mixedPixel(i, 1, 0); })), 0.005);
}

TEST(LocalMeans, KeepNoiseThatPixelsHaveInCommonOut) {
    const auto inBlocks = [](size_t i) { return mixedPixel(i / kSize / 8 * 8 + i % kSize / 8, 1, 0); };
    EXPECT_LT(meanSquare(corrections(inBlocks)), 0.15); // the means of the own values: nearly 1
}

TEST(LocalMeans, KeepBrightSamplesOfBothHalvesOut) {
    // One bright sample in each half, in neighboring pixels.
    constexpr size_t kPixel = 30 * kSize + 30;
    const auto corrected = corrections([](size_t i) {
        const float sign = i == kPixel ? 1.f : i == kPixel + 1 ? -1.f : 0.f;
        return MixedPixel{Rgb(100 * std::abs(sign)), 1, 300 * sign, 300 * sign};
    });
    EXPECT_LT(corrected[kPixel], 1); // their mean over the window of 2 pixels: 8
}

TEST(LocalMeans, AreSharedInProportionToDeviations) {
    // Bias in every other column, where the errors of the mixture are expected.
    LocalMeans means(kSize, kSize, true);
    means.compute([](size_t i) {
        const bool isBiased = i % 2 == 0;
        return MixedPixel{Rgb(isBiased ? -1.f : 0.f), isBiased ? 1.f : 0.f, 0, 0};
    });
    for (size_t i = 0; i < kSize * kSize; ++i)
        EXPECT_NEAR(means.correction(i).y, -1, 1e-4); // relative to the deviation
}

TEST(LocalMeans, KeepColors) {
    LocalMeans means(kSize, kSize, true);
    means.compute([](size_t) { return MixedPixel{Rgb(1, 0, -0.5f), 2, 0, 0}; });
    const Rgb at = means.correction(100);
    EXPECT_NEAR(at.x, 0.5, 1e-5);
    EXPECT_NEAR(at.y, 0, 1e-5);
    EXPECT_NEAR(at.z, -0.25, 1e-5);
}

TEST(LocalMeans, AreFiniteInAnyImage) {
    for (const auto& [width, height] :
         {std::pair(1, 1), std::pair(3, 1), std::pair(1, 17), std::pair(33, 7)}) {
        for (const float x : corrections([](size_t i) { return mixedPixel(i, 1, 1); }, width, height))
            EXPECT_TRUE(std::isfinite(x));
        for (const float x : corrections([](size_t i) { return mixedPixel(i, 1e18f, 1); }, width, height))
            EXPECT_TRUE(std::isfinite(x));
        for (const float x : corrections([](size_t) { return MixedPixel(); }, width, height))
            EXPECT_EQ(x, 0);
    }
}

} // namespace
