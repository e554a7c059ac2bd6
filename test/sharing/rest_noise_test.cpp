// The noise of light that is not mixed with shared estimates.
#include "sharing/rest_noise.h"

#include "core/math/hash.h"
#include "sharing/frame_light.h"

#include <gtest/gtest.h>

#include <random>

namespace strobe {
namespace {

constexpr int kSize = 48;
constexpr uint32_t kSamplesPerHalf = 4;
constexpr float kDeviation = 0.25f; ///< of the emission of a half of a pixel

/// Adds the sum of samples to a half of a pixel.
void add(HalfLight& half, double emission, double indirect, double rare) {
    const double samples = kSamplesPerHalf;
    for (HalfLight::Quarter& quarter : half.quarters) {
        quarter.count = kSamplesPerHalf / kQuarters;
        quarter.light[int(LightPart::Indirect)].add(Rgb(float(indirect * quarter.count)));
    }
    half.emitted.add(Rgb(float(emission * samples)));
    half.v.add((emission + indirect) * samples + rare);
    if (rare > 0)
        half.rare.push_back({0, uint8_t(LightPart::Indirect), false, Rgb(float(rare)), Rgb(1)});
}

/// Pixels with independent emission. Their indirect light, which is shared, has ten times its noise.
RecordedLight noisyLight() {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const Film film(kSize, kSize, {0, 0, kSize, kSize});
    FrameLight frame{LightParts(2)};
    frame.beginTile(film);
    PixelLists lists;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            PixelLight pixel;
            for (HalfLight& half : pixel.halves)
                add(half, 2 + double(kDeviation) * normal(random),
                    30 + 10 * double(kDeviation) * normal(random),
                    (x + y) % 9 == 0 ? 900 * std::abs(normal(random)) : 0);
            frame.setPixel(x, y, pixel, lists);
        }
    frame.add(std::vector<CellSums>(1), lists);
    return frame.take(film);
}

double mean(const HugeVector<float>& values) {
    double sum = 0;
    for (const float v : values)
        sum += double(v);
    return sum / double(values.size());
}

/// The variance of the mean of both halves.
constexpr double kVariance = double(kDeviation) * kDeviation / 2;
/// Of the mean of that many squared differences, with some for the edges of the image.
constexpr double kTolerance = 5 * 1.5 / kSize * kVariance;

TEST(RestNoise, IsThatOfEmission) {
    EXPECT_NEAR(mean(restVariance(noisyLight(), {})), kVariance, kTolerance);
}

TEST(RestNoise, IsLessWhereMoreRaysFoundTheEmission) {
    constexpr float kReplaced = 0.75f;
    std::vector<PixelCorrection> corrections;
    for (size_t i = 0; i < kSize * kSize; ++i)
        corrections.push_back({i, Rgb(0), kReplaced});
    constexpr double kScale = (1 - double(kReplaced)) * (1 - double(kReplaced));
    EXPECT_NEAR(mean(restVariance(noisyLight(), corrections)), kScale * kVariance, kScale * kTolerance);
}

} // namespace
} // namespace strobe
