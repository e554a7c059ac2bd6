#include "core/film/pixel_accumulator.h"

#include "core/math/hash.h"

#include <gtest/gtest.h>

#include <vector>

namespace strobe {
namespace {

/// A number of any sign, with an exponent anywhere from -60 to 40.
float anyFloat(uint64_t random) {
    const float sign = random & 1 ? -1.f : 1.f;
    return sign * std::ldexp(1 + unitFloat(uint32_t(random >> 32)), int((random >> 8) % 101) - 60);
}

struct Sample {
    Rgb value;
    float weight;
};

std::vector<Sample> samples(size_t n) {
    std::vector<Sample> out;
    for (uint64_t i = 0; i < n; ++i)
        out.push_back({Rgb(anyFloat(hashOf(i, 1)), anyFloat(hashOf(i, 2)), anyFloat(hashOf(i, 3))),
                       hashOf(i, 4) % 3 ? 1.25f : -1.25f});
    return out;
}

PixelAccumulator sumOf(const std::vector<Sample>& all) {
    PixelAccumulator sum;
    for (const Sample& s : all)
        EXPECT_TRUE(sum.add(s.value, s.weight));
    return sum;
}

TEST(PixelAccumulator, OrderAndGroupingDoNotMatter) {
    std::vector<Sample> all = samples(1000);
    const PixelAccumulator whole = sumOf(all);
    std::sort(all.begin(), all.end(), [](const Sample& a, const Sample& b) { return a.value.y < b.value.y; });
    EXPECT_EQ(sumOf(all), whole);
    PixelAccumulator parts[7], total;
    for (size_t i = 0; i < all.size(); ++i)
        parts[hashOf(i) % 7].add(all[i].value, all[i].weight);
    for (const PixelAccumulator& part : parts)
        total.add(part);
    EXPECT_EQ(total, whole);
    EXPECT_FALSE(total == PixelAccumulator());
}

TEST(PixelAccumulator, TogetherIsOneByOne) {
    const std::vector<Sample> all = samples(2000);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    int together = 0;
    for (size_t first = 0; first + kSoAWidth <= all.size(); ++first) {
        const int n = 1 + int(first % kSoAWidth), from = int(first % size_t(n));
        Rgb values[kSoAWidth];
        float weights[kSoAWidth];
        PixelAccumulator one, many;
        for (int i = 0; i < n; ++i) {
            // Of all sizes, but mostly small enough.
            values[i] = all[first + size_t(i)].value * (first % 3 ? 0x1p-41f : 1.f);
            weights[i] = all[first + size_t(i)].weight;
            if (i >= from)
                one.add(values[i], weights[i]);
        }
        FixedPointSamples samplesFixed;
        if (samplesFixed.set(values, weights, n)) {
            many.add(samplesFixed, from, n - from);
            EXPECT_EQ(one, many);
            ++together;
        }
        values[n / 2].y = nan;
        EXPECT_FALSE(samplesFixed.set(values, weights, n));
    }
    EXPECT_GT(together, 1000);
}

TEST(PixelAccumulator, IsTheMeanInDouble) {
    const std::vector<Sample> all = samples(1000);
    Imath::Vec3<double> sum(0);
    for (const Sample& s : all)
        sum += Imath::Vec3<double>(s.value.x, s.value.y, s.value.z) * double(s.weight);
    const Rgb mean = sumOf(all).mean();
    for (int c = 0; c < 3; ++c)
        EXPECT_FLOAT_EQ(mean[c], float(sum[c] / 1000));
    PixelAccumulator one;
    one.add(Rgb(0.1f, -3e-4f, 12345.678f), 1);
    EXPECT_EQ(one.mean(), Rgb(0.1f, -3e-4f, 12345.678f)) << "one sample is itself";
}

TEST(PixelAccumulator, LargeValuesKeepEveryBit) {
    for (const float v : {127.99999f, 128.f, 1234567.f, 2.7e14f}) {
        PixelAccumulator sum;
        EXPECT_TRUE(sum.add(Rgb(v, -v, 0), 1));
        EXPECT_TRUE(sum.add(Rgb(-v, v, 0.f), 1)) << "opposites cancel";
        EXPECT_TRUE(sum.add(Rgb(v, -v, 2), 1));
        EXPECT_EQ(sum.mean(), Rgb(float(double(v) / 3), float(double(-v) / 3), float(2.0 / 3)));
    }
}

TEST(PixelAccumulator, WhatIsNoNumberIsCountedApart) {
    PixelAccumulator sum;
    EXPECT_TRUE(sum.add(Rgb(1, 2, 3), 1));
    for (const float bad : {NAN, INFINITY, -INFINITY, 3e14f})
        for (int c = 0; c < 3; ++c) {
            Rgb value(5);
            value[c] = bad;
            EXPECT_FALSE(sum.add(value, 1)) << bad;
        }
    EXPECT_EQ(sum.good(), 1u);
    EXPECT_EQ(sum.bad(), 12u);
    EXPECT_EQ(sum.mean(), Rgb(1, 2, 3));
    EXPECT_EQ(PixelAccumulator().mean(), Rgb(0));
}

TEST(PixelAccumulator, TheMostSamplesOfTheLargestValueDoNotOverflow) {
    PixelAccumulator sum;
    const float v = std::nextafter(float(PixelAccumulator::kMaxValue), 0.f);
    ASSERT_TRUE(sum.add(Rgb(v, -v, v), 1));
    for (uint32_t n = 1; n < PixelAccumulator::kMaxSamples; n *= 2)
        sum.add(PixelAccumulator(sum));
    EXPECT_EQ(sum.good(), PixelAccumulator::kMaxSamples);
    EXPECT_EQ(sum.mean(), Rgb(v, -v, v));
}

} // namespace
} // namespace strobe
