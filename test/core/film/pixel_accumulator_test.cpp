#include "core/film/pixel_accumulator.h"

#include "core/math/hash.h"

#include <gtest/gtest.h>

#include <vector>

namespace strobe {
namespace {

/// A float of any sign, with an exponent from -60 to 40.
float randomFloat(uint64_t random) {
    const float sign = random & 1 ? -1.f : 1.f;
    return sign * std::ldexp(1 + unitFloat(uint32_t(random >> 32)), int((random >> 8) % 101) - 60);
}

struct Sample {
    Rgb value;
    float weight;
};

std::vector<Sample> randomSamples(size_t n) {
    std::vector<Sample> out;
    for (uint64_t i = 0; i < n; ++i)
        out.push_back({Rgb(randomFloat(hashOf(i, 1)), randomFloat(hashOf(i, 2)), randomFloat(hashOf(i, 3))),
                       hashOf(i, 4) % 3 ? 1.f : -1.f});
    return out;
}

PixelAccumulator sumOf(const std::vector<Sample>& samples) {
    PixelAccumulator sum;
    for (const Sample& s : samples)
        EXPECT_TRUE(sum.add(s.value, s.weight));
    return sum;
}

TEST(PixelAccumulator, SumsDoNotDependOnOrderAndGrouping) {
    std::vector<Sample> samples = randomSamples(1000);
    const PixelAccumulator whole = sumOf(samples);
    std::sort(samples.begin(), samples.end(),
              [](const Sample& a, const Sample& b) { return a.value.y < b.value.y; });
    EXPECT_EQ(sumOf(samples), whole);
    PixelAccumulator sums[7], total;
    for (size_t i = 0; i < samples.size(); ++i)
        sums[hashOf(i) % 7].add(samples[i].value, samples[i].weight);
    for (const PixelAccumulator& sum : sums)
        total.add(sum);
    EXPECT_EQ(total, whole);
    EXPECT_FALSE(total == PixelAccumulator());
}

TEST(PixelAccumulator, FixedPointSamplesAddUpLikeSingleSamples) {
    const std::vector<Sample> samples = randomSamples(2000);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    int conversions = 0;
    for (size_t first = 0; first + kSoAWidth <= samples.size(); ++first) {
        const int n = 1 + int(first % kSoAWidth), begin = int(first % size_t(n));
        Rgb values[kSoAWidth];
        float weights[kSoAWidth];
        PixelAccumulator scalar, soa;
        for (int i = 0; i < n; ++i) {
            // Two thirds of the chunks have values small enough for fixed point.
            values[i] = samples[first + size_t(i)].value * (first % 3 ? 0x1p-41f : 1.f);
            weights[i] = samples[first + size_t(i)].weight;
            if (i >= begin)
                scalar.add(values[i], weights[i]);
        }
        FixedPointSamples fixedPoint;
        if (fixedPoint.set(values, weights, n)) {
            soa.add(fixedPoint, begin, n - begin);
            EXPECT_EQ(scalar, soa);
            ++conversions;
        }
        values[n / 2].y = nan;
        EXPECT_FALSE(fixedPoint.set(values, weights, n));
    }
    EXPECT_GT(conversions, 1000);
}

TEST(PixelAccumulator, MeanEqualsTheMeanInDoublePrecision) {
    const std::vector<Sample> samples = randomSamples(1000);
    Imath::Vec3<double> sum(0);
    double weight = 0;
    for (const Sample& s : samples) {
        sum += Imath::Vec3<double>(s.value.x, s.value.y, s.value.z) * double(s.weight);
        weight += double(s.weight);
    }
    const Rgb mean = sumOf(samples).mean();
    for (int c = 0; c < 3; ++c)
        EXPECT_FLOAT_EQ(mean[c], float(sum[c] / weight));
    PixelAccumulator one;
    one.add(Rgb(0.1f, -3e-4f, 12345.678f), 1);
    EXPECT_EQ(one.mean(), Rgb(0.1f, -3e-4f, 12345.678f)) << "one sample";
}

TEST(PixelAccumulator, TheMeanIsDividedByTheWeights) {
    PixelAccumulator sum;
    sum.add(Rgb(5), -1);
    EXPECT_EQ(sum.mean(), Rgb(5));
    sum.add(Rgb(7), 1);
    EXPECT_EQ(sum.weight(), 0);
    EXPECT_EQ(sum.mean(), Rgb(0));
    sum.add(Rgb(8), 1);
    EXPECT_EQ(sum.weight(), 1);
    EXPECT_EQ(sum.mean(), Rgb(10));
    char bytes[PixelAccumulator::kBytes];
    sum.store(bytes);
    PixelAccumulator loaded;
    loaded.load(bytes);
    EXPECT_EQ(loaded, sum);
}

TEST(PixelAccumulator, SumsOfLargeValuesAreExact) {
    for (const float v : {127.99999f, 128.f, 1234567.f, 2.7e14f}) {
        PixelAccumulator sum;
        EXPECT_TRUE(sum.add(Rgb(v, -v, 0), 1));
        EXPECT_TRUE(sum.add(Rgb(-v, v, 0.f), 1)) << "opposites cancel";
        EXPECT_TRUE(sum.add(Rgb(v, -v, 2), 1));
        EXPECT_EQ(sum.mean(), Rgb(float(double(v) / 3), float(double(-v) / 3), float(2.0 / 3)));
    }
}

TEST(PixelAccumulator, InvalidSamplesAreCountedButNotAdded) {
    PixelAccumulator sum;
    EXPECT_TRUE(sum.add(Rgb(1, 2, 3), 1));
    for (const float invalid : {NAN, INFINITY, -INFINITY, 3e14f})
        for (int c = 0; c < 3; ++c) {
            Rgb value(5);
            value[c] = invalid;
            EXPECT_FALSE(sum.add(value, 1)) << invalid;
        }
    EXPECT_EQ(sum.validCount(), 1u);
    EXPECT_EQ(sum.invalidCount(), 12u);
    EXPECT_EQ(sum.mean(), Rgb(1, 2, 3));
    EXPECT_EQ(PixelAccumulator().mean(), Rgb(0));
}

TEST(PixelAccumulator, TheMaximumSumDoesNotOverflow) {
    PixelAccumulator sum;
    const float v = std::nextafter(float(PixelAccumulator::kMaxValue), 0.f);
    ASSERT_TRUE(sum.add(Rgb(v, -v, v), 1));
    for (uint32_t n = 1; n < PixelAccumulator::kMaxSamples; n *= 2)
        sum.add(PixelAccumulator(sum));
    EXPECT_EQ(sum.validCount(), PixelAccumulator::kMaxSamples);
    EXPECT_EQ(sum.mean(), Rgb(v, -v, v));
}

} // namespace
} // namespace strobe
