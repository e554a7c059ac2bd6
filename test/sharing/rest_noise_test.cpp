// The noise of light that is not mixed with shared estimates.
#include "sharing/rest_noise.h"

#include "sharing/frame_light.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace strobe {
namespace {

constexpr int kSize = 48;
constexpr int kSamplesPerHalf = 4, kSamples = kHalves * kSamplesPerHalf;

struct SampleOfLight {
    double emission = 0, direct = 0;
};

/// Indirect light is shared, and has more noise than all other. Some of it is rare. sampleAt(x, i) returns
/// the light of the i-th sample of a pixel of column x that is not shared.
RecordedLight recordLight(const std::function<SampleOfLight(int, int)>& sampleAt) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const Film film(kSize, kSize, {0, 0, kSize, kSize});
    FrameLight frame{LightParts(2)};
    frame.beginTile(film);
    PixelLists lists;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            PixelLight pixel;
            for (int i = 0; i < kSamples; ++i) {
                HalfLight& half = pixel.halves[i / kSamplesPerHalf];
                HalfLight::Quarter& quarter = half.quarters[i % kQuarters];
                const SampleOfLight light = sampleAt(x, i);
                const auto indirect = float(30 + 5 * normal(random));
                const float rare = i == 0 && y % 9 == 0 ? 900.f : 0.f;
                ++quarter.count;
                quarter.light[int(LightPart::Indirect)].add(Rgb(indirect));
                half.emitted.add(Rgb(float(light.emission)));
                half.ee.add(light.emission * light.emission);
                half.v.add(light.emission + light.direct + double(indirect) + double(rare));
                if (rare > 0)
                    half.rare.push_back({0, uint8_t(LightPart::Indirect), true, Rgb(rare), Rgb(1)});
            }
            frame.setPixel(x, y, pixel, lists);
        }
    frame.add(std::vector<CellSums>(1), lists);
    return frame.take(film);
}

/// The mean over a column of pixels.
double meanOfColumn(const HugeVector<float>& values, int x) {
    double sum = 0;
    for (int y = 0; y < kSize; ++y)
        sum += double(values[size_t(y) * kSize + size_t(x)]);
    return sum / kSize;
}

double mean(const HugeVector<float>& values) {
    double sum = 0;
    for (int x = 0; x < kSize; ++x)
        sum += meanOfColumn(values, x);
    return sum / kSize;
}

/// The relative tolerance of a mean over all pixels of squared differences.
constexpr double kTolerance = 5 * 1.5 / kSize;

TEST(RestNoise, OfEmissionStaysInItsPixels) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    constexpr int kEdge = 20;
    const RecordedLight light =
        recordLight([&](int x, int) { return SampleOfLight{x == kEdge ? 100 + 10 * normal(random) : 0}; });
    const HugeVector<float> variance = restVariance(light, {});
    EXPECT_NEAR(meanOfColumn(variance, kEdge), 100. / kSamples, 50. / kSamples);
    EXPECT_LT(meanOfColumn(variance, kEdge - 1), 1e-6);
    EXPECT_LT(meanOfColumn(variance, kEdge + 1), 1e-6);
}

TEST(RestNoise, OfStratifiedEmissionIsLess) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    const RecordedLight light =
        recordLight([&](int, int i) { return SampleOfLight{3 + (i % 2 ? 1 : -1) + 0.1 * normal(random)}; });
    EXPECT_NEAR(mean(restVariance(light, {})), 0.01 / kSamples, 2 * kTolerance * 0.01 / kSamples);
}

TEST(RestNoise, IsLessWhereMoreRaysFoundTheEmission) {
    std::mt19937 random(11);
    std::normal_distribution<double> normal;
    const RecordedLight light =
        recordLight([&](int, int) { return SampleOfLight{3 + 0.5 * normal(random)}; });
    constexpr float kReplaced = 0.75f;
    std::vector<PixelCorrection> corrections;
    for (size_t i = 0; i < kSize * kSize; ++i)
        corrections.push_back({i, Rgb(0), kReplaced});
    const double all = mean(restVariance(light, {}));
    EXPECT_NEAR(all, 0.25 / kSamples, kTolerance * 0.25 / kSamples);
    EXPECT_NEAR(mean(restVariance(light, corrections)), (1 - double(kReplaced)) * all, 1e-3 * all);
}

TEST(RestNoise, HasThatOfPartsThatAreNotShared) {
    std::mt19937 random(13);
    std::normal_distribution<double> normal;
    const RecordedLight light = recordLight([&](int, int) {
        return SampleOfLight{0, 3 + 0.5 * normal(random)};
    });
    EXPECT_NEAR(mean(restVariance(light, {})), 0.25 / kSamples, kTolerance * 0.25 / kSamples);
}

} // namespace
} // namespace strobe
