#include "sharing/errors/bright_pixels.h"
#include "sharing/errors/squared_bias.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

constexpr int kSize = 64, kMiddle = 32 * kSize + 32;
constexpr float kSigma = 2.5f;

/// Pixels of brightness 1, and one that is different.
BrightPixels pixelsWith(const Brightness& other) {
    std::vector<Brightness> brightness(size_t(kSize * kSize), {1, 1});
    brightness[kMiddle] = other;
    return BrightPixels(brightness, kSize, kSize);
}

TEST(BrightPixels, AreMuchBrighterThanThoseAround) {
    EXPECT_TRUE(pixelsWith({1, 1}).all().empty());
    EXPECT_TRUE(pixelsWith({1.9f, 1.9f}).all().empty());
    const BrightPixels bright = pixelsWith({100, 100});
    ASSERT_EQ(bright.all().size(), 1u);
    EXPECT_EQ(bright.all()[0].index, uint32_t(kMiddle));
    EXPECT_EQ(bright.others()[kMiddle], 0);
    EXPECT_EQ(bright.others()[kMiddle + 1], 1);
    // The limit is twice the brightness around, to which the pixel itself adds a percent.
    EXPECT_NEAR(bright.all()[0].weight, std::pow(0.02, 4), 0.2 * std::pow(0.02, 4));
}

TEST(BrightPixels, AreBrightInBothHalves) { EXPECT_TRUE(pixelsWith({100, 1}).all().empty()); }

TEST(BrightPixels, AreThoseOfBrightRegionsOnlyWhereTheseAreSmall) {
    std::vector<Brightness> brightness(size_t(kSize * kSize), {1, 1});
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize / 2; ++x)
            brightness[size_t(y * kSize + x)] = {100, 100};
    const BrightPixels bright(brightness, kSize, kSize);
    EXPECT_EQ(bright.others()[32 * kSize + 8], 1);
    EXPECT_EQ(bright.others()[32 * kSize + 56], 1);
}

TEST(BrightPixels, HaveAWeightBesideBlackPixels) {
    std::vector<Brightness> brightness(size_t(kSize * kSize));
    brightness[kMiddle] = {1e9f, 1e9f};
    const BrightPixels bright(brightness, kSize, kSize);
    ASSERT_EQ(bright.all().size(), 1u);
    EXPECT_GT(bright.all()[0].weight, 0);
}

TEST(BrightPixels, AnEmptyImageHasNone) {
    EXPECT_TRUE(BrightPixels(std::vector<Brightness>(size_t(kSize * kSize)), kSize, kSize).all().empty());
}

/// Averages a plane of 1 whose middle has `value`, with the middle as a bright pixel.
LanePlane averaged(float value) {
    const BrightPixels bright = pixelsWith({100, 100});
    LanePlane plane(kSize, kSize), scratch(kSize, kSize);
    for (int i = 0; i < kSize * kSize; ++i)
        storeFloat4(plane.at(size_t(i)), Float4{} + (i == kMiddle ? value : 1.f));
    const WindowMean window(kSize, kSize, kSigma);
    const BrightMeans means(plane, window, bright);
    means.fade(plane);
    window.apply(plane, scratch);
    means.write(plane);
    return plane;
}

TEST(BrightMeans, CountLessAroundBrightPixels) {
    const LanePlane plane = averaged(1e4f);
    EXPECT_NEAR(*plane.at(kMiddle + 1), 1, 1e-3);
    EXPECT_NEAR(*plane.at(kMiddle + 5 * kSize), 1, 1e-3);
    // The window of the pixel itself has all pixels: its own weight is 1 / (2 pi sigma^2).
    EXPECT_NEAR(*plane.at(kMiddle), 1 + 1e4 / (2 * 3.14159 * kSigma * kSigma), 5);
}

TEST(BrightMeans, EqualAConstant) {
    const LanePlane plane = averaged(1);
    for (int i = 0; i < kSize * kSize; ++i)
        ASSERT_NEAR(*plane.at(size_t(i)), 1, 1e-5);
}

/// The squared bias of a highlight, a hundred times as bright as the wall around it, beside that of the wall.
TEST(BrightPixels, KeepTheirBiasToThemselves) {
    SquaredBias bias(kSize, kSize, kSigma);
    for (int i = 0; i < kSize * kSize; ++i)
        bias.set(size_t(i), Float4{} + (i == kMiddle ? 1e4f : 1e-4f), Float4{});
    LanePlane scratch(kSize, kSize);
    bias.average(pixelsWith({100, 100}), scratch);
    EXPECT_LT(bias.at(kMiddle + 2)[0], 1e-3f);
    EXPECT_LT(bias.at(kMiddle + 12)[0], 1e-3f); // within the wide window
    EXPECT_NEAR(bias.at(kMiddle)[0], 1e4 / (2 * 3.14159 * kSigma * kSigma), 5);
}

} // namespace
} // namespace strobe
