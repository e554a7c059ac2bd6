#include "core/film/noise.h"

#include "core/math/hash.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

TEST(StudentQuantile, EqualsTables) {
    EXPECT_NEAR(studentQuantile(0.95, 1), 12.7062, 1e-4);
    EXPECT_NEAR(studentQuantile(0.95, 2), 4.30265, 1e-5);
    EXPECT_NEAR(studentQuantile(0.95, 3), 3.18245, 1e-5);
    EXPECT_NEAR(studentQuantile(0.99, 4), 4.60409, 1e-5);
    EXPECT_NEAR(studentQuantile(0.95, 10), 2.22814, 1e-5);
    EXPECT_NEAR(studentQuantile(0.95, 31), 2.03951, 1e-5);
    EXPECT_NEAR(studentQuantile(0.95, 100000), 1.95998, 1e-4);
}

/// A gray image of independent normally distributed pixels.
Image noisy(int width, int height, float mean, float deviation, uint64_t seed) {
    Image image{width, height, {}};
    for (int i = 0; i < width * height; ++i) {
        const uint64_t h = hashOf(seed, i);
        const float radius = std::sqrt(-2 * std::log(1 - unitFloat(uint32_t(h))));
        image.pixels.push_back(
            Rgb(mean + deviation * radius * std::cos(2 * kPi * unitFloat(uint32_t(h >> 32)))));
    }
    return image;
}

TEST(NoiseEstimate, ConfidenceIntervalsHaveTheirNominalCoverage) {
    for (const int passes : {2, 3, 5, 12}) {
        const int n = 200;
        NoiseEstimate estimate;
        std::vector<double> sum(size_t(n) * n);
        for (int p = 0; p < passes; ++p) {
            const Image pass = noisy(n, n, 0.5f, 0.1f, uint64_t(1000 * passes + p));
            estimate.add(pass);
            for (size_t i = 0; i < sum.size(); ++i)
                sum[i] += luminance(pass.pixels[i]) / passes;
        }
        size_t covered = 0;
        const std::vector<float> noise = estimate.pixels();
        for (size_t i = 0; i < sum.size(); ++i)
            covered += std::abs(sum[i] - 0.5) <= noise[i] * std::max(sum[i], 0.1);
        const double coverage = double(covered) / double(sum.size());
        EXPECT_GE(coverage, 0.95) << passes; // the 3×3 mean only widens intervals
        if (passes == 12) {
            EXPECT_LE(coverage, 0.985);
        }
    }
}

TEST(NoiseEstimate, LevelIsProportionalToTheInverseRootOfPasses) {
    NoiseEstimate estimate;
    EXPECT_EQ(estimate.level(), kInfinity);
    std::vector<double> levels;
    for (int p = 1; p <= 400; ++p) {
        estimate.add(noisy(40, 40, 0.5f, 0.1f, uint64_t(p)));
        if (p == 1) {
            EXPECT_EQ(estimate.level(), kInfinity);
        }
        if (p == 100 || p == 400)
            levels.push_back(estimate.level());
    }
    EXPECT_NEAR(levels[1], 1.966 * 0.1 / 20 / 0.5, 0.1 * levels[1]);
    EXPECT_NEAR(levels[0] / levels[1], 2, 0.15);
}

TEST(NoiseEstimate, VariancesAreOfTheMeanOfThePasses) {
    NoiseEstimate estimate;
    for (int p = 0; p < 20; ++p) {
        estimate.add(noisy(100, 100, 0.5f, 0.1f, uint64_t(p)));
        if (p == 0) {
            EXPECT_EQ(estimate.variances().at(0), kInfinity);
        }
    }
    double mean = 0;
    for (const float v : estimate.variances())
        mean += double(v) / 10000;
    // The relative standard error of the mean of 10,000 variances, each of 20 values, is sqrt(2 / 19) / 100.
    EXPECT_NEAR(mean, 0.01 / 20, 5 * std::sqrt(2. / 19) / 100 * 0.01 / 20);
}

TEST(NoiseEstimate, NoiseOfDarkPixelsIsRelativeToTheFloor) {
    NoiseEstimate dark;
    for (int p = 0; p < 100; ++p)
        dark.add(noisy(20, 20, 0, 0.01f, uint64_t(p)));
    EXPECT_NEAR(dark.level(), 1.984 * 0.01 / 10 / NoiseEstimate::kFloor, 0.1 * dark.level());
}

TEST(NoiseLevel, IsThatOfThePixelAtTheFraction) {
    Image image{10, 10, std::vector<Rgb>(100)};
    std::vector<float> errors;
    for (int i = 0; i < 100; ++i) {
        image.pixels[size_t(i)] = Rgb(i % 2 ? 0.05f : 2.f); // the darker ones are below the floor
        errors.push_back(float(i + 1) * (i % 2 ? NoiseEstimate::kFloor : 2.f));
    }
    EXPECT_NEAR(noiseLevel(image, errors), 1.96 * 95, 1e-3);
    EXPECT_EQ(noiseLevel(Image(), {}), double(kInfinity));
}

TEST(NoiseEstimate, PixelsBelowTheMeanVarianceOfTheirNeighborsUseIt) {
    NoiseEstimate estimate;
    for (int p = 0; p < 6; ++p) {
        Image pass = noisy(5, 5, 0.5f, 0.1f, uint64_t(p));
        pass.at(2, 2) = Rgb(0.5f);
        for (int y = 0; y < 5; ++y) {
            pass.at(0, y) = Rgb(0.5f);
            pass.at(1, y) = Rgb(0.5f);
        }
        estimate.add(pass);
    }
    const std::vector<float> noise = estimate.pixels();
    EXPECT_GT(noise[2 * 5 + 2], 0.05f);
    EXPECT_EQ(noise[2 * 5 + 0], 0) << "all 3×3 pixels are equal in all passes";
}

} // namespace
} // namespace strobe
