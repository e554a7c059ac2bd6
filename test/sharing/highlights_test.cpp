// Bright light that stays in its pixels.
#include "sharing/errors/highlights.h"

#include "core/math/hash.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

constexpr int kSize = 32, kHalves = 2;

size_t pixelAt(int x, int y) { return size_t(y) * kSize + size_t(x); }

/// Returns a number in [0,1) for a pixel and a half.
float uniform(size_t pixel, int half) { return unitFloat(uint32_t(hashOf(pixel, half))); }

/// Adds light to a horizontal line through (16, 16): to each half of a pixel with this probability.
void addLine(Highlights& highlights, float probability) {
    for (int x = 0; x < kSize; ++x)
        for (int half = 0; half < kHalves; ++half)
            if (uniform(pixelAt(x, 16), half) < probability)
                highlights.add(pixelAt(x, 16), half, 10);
}

/// A thin highlight without noise.
TEST(Highlights, LinesStayInTheirPixels) {
    Highlights highlights(kSize, kSize);
    addLine(highlights, 1);
    EXPECT_GT(highlights.kept(pixelAt(16, 16)), 0.9f);
}

/// Most of the light is noise: neighbors know more.
TEST(Highlights, NoisyLinesAreShared) {
    Highlights highlights(kSize, kSize);
    addLine(highlights, 0.15f);
    EXPECT_LT(highlights.kept(pixelAt(16, 16)), 0.1f);
}

/// Light without contrast is that of a wide highlight.
TEST(Highlights, EvenLightIsShared) {
    Highlights highlights(kSize, kSize);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            for (int half = 0; half < kHalves; ++half)
                highlights.add(pixelAt(x, y), half, 5 + uniform(pixelAt(x, y), half));
    EXPECT_LT(highlights.kept(pixelAt(16, 16)), 0.05f);
}

/// Two bright samples that meet in one pixel look like a highlight of this pixel.
TEST(Highlights, SinglePixelsAreShared) {
    Highlights highlights(kSize, kSize);
    for (int half = 0; half < kHalves; ++half)
        highlights.add(pixelAt(16, 16), half, 10);
    EXPECT_EQ(highlights.kept(pixelAt(16, 16)), 0);
}

/// Sparse bright samples: a fifth of the pixels has one in each half, by chance.
TEST(Highlights, ChanceKeepsLittle) {
    Highlights highlights(kSize, kSize);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            for (int half = 0; half < kHalves; ++half)
                if (uniform(pixelAt(x, y), half) < 0.2f)
                    highlights.add(pixelAt(x, y), half, 10);
    float sum = 0;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            sum += highlights.kept(pixelAt(x, y));
    EXPECT_LT(sum / (kSize * kSize), 0.03f);
}

TEST(Highlights, KeepNothingWithoutLight) {
    const Highlights highlights(kSize, kSize);
    EXPECT_EQ(highlights.kept(0), 0);
}

} // namespace
} // namespace strobe
