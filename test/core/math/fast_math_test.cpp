// Compares core/math/fast_math.h with double precision, and checks the errors that it states.
#include "core/math/fast_math.h"

#include <gtest/gtest.h>

using namespace strobe;

namespace {

/// Calls check(x) for about 500,000 floats from a to b, both positive, whose bit patterns are evenly spaced.
template <class Check>
void forFloats(float a, float b, const Check& check) {
    const auto first = std::bit_cast<uint32_t>(a), last = std::bit_cast<uint32_t>(b);
    const uint32_t step = std::max(1u, (last - first) / 500000);
    for (uint64_t bits = first; bits <= last; bits += step)
        check(std::bit_cast<float>(uint32_t(bits)));
    check(b);
}

double relativeError(double value, double expected) {
    return std::abs(value - expected) / std::abs(expected);
}

} // namespace

TEST(FastMath, Log2HasTheStatedError) {
    double worst = 0;
    const auto check = [&](float x) {
        if (x != 1)
            worst = std::max(worst, relativeError(fastLog2(x), std::log2(double(x))));
    };
    forFloats(std::numeric_limits<float>::min(), std::numeric_limits<float>::max(), check);
    forFloats(.5f, 2.f, check); // around the root at 1, and the interval ends √½ and √2
    EXPECT_LT(worst, 4e-7);
    EXPECT_EQ(fastLog2(1), 0);
    EXPECT_EQ(fastLog2(0), -127);
}

TEST(FastMath, Exp2HasTheStatedError) {
    double worst = 0;
    for (double x = -126; x < 127.5; x += 1e-4)
        worst = std::max(worst, relativeError(fastExp2(float(x)), std::exp2(double(float(x)))));
    EXPECT_LT(worst, 2e-7);
    EXPECT_EQ(fastExp2(0), 1);
    EXPECT_EQ(fastExp2(-7), 0x1p-7f);
    EXPECT_EQ(fastExp2(-1000), 0);
    EXPECT_EQ(fastExp2(1000), kInfinity);
}

TEST(FastMath, PowAndExpHaveTheStatedErrors) {
    double worst = 0, worstExp = 0;
    for (const float y : {1e-4f, .1f, 1.f, 2.5f, 40.f, 500.f, 10000.f})
        forFloats(.01f, 1.f, [&](float x) {
            const double expected = std::pow(double(x), double(y));
            const double exponent = std::log2(double(x)) * y;
            if (exponent > -126)
                worst = std::max(worst, relativeError(fastPow(x, y), expected) / (1 + std::abs(exponent)));
        });
    EXPECT_LT(worst, 1e-6);
    EXPECT_EQ(fastPow(1, 10000), 1);
    EXPECT_EQ(fastPow(0, 10), 0);
    for (double x = -80; x < 80; x += 1e-3)
        worstExp = std::max(worstExp,
                            relativeError(fastExp(float(x)), std::exp(double(float(x)))) / (1 + std::abs(x)));
    EXPECT_LT(worstExp, 3e-7);
}

TEST(FastMath, Atan2HasTheStatedErrors) {
    double worst = 0, worstRelative = 0;
    const auto check = [&](float y, float x) {
        const double expected = std::atan2(double(y), double(x));
        const double error = std::abs(fastAtan2(y, x) - expected);
        worst = std::max(worst, error);
        worstRelative = std::max(worstRelative, error / std::abs(expected));
    };
    for (int i = 1; i < 400000; ++i) {
        const double a = (i - 200000.5) / 200000 * M_PI;
        for (const double r : {1., 1e-10, 1e10})
            check(float(r * std::sin(a)), float(r * std::cos(a)));
    }
    forFloats(1e-30f, 1e30f, [&](float t) {
        check(t, 1);
        check(1, t);
        check(-t, 1);
        check(t, -1);
    });
    EXPECT_LT(worst, 4e-7);
    EXPECT_LT(worstRelative, 4e-7);
    EXPECT_EQ(fastAtan2(0, 0), 0);
    EXPECT_EQ(fastAtan2(0, 3), 0);
    EXPECT_EQ(fastAtan2(0, -3), kPi);
    EXPECT_EQ(fastAtan2(-2, 0), -kPi / 2);
}

TEST(FastMath, SinCosOfTurnsHasTheStatedError) {
    double worst = 0;
    for (int i = -300000; i <= 300000; ++i) {
        const float turns = float(i) * 1e-5f;
        const SinCos s = sinCosOfTurns(turns);
        worst = std::max(worst, std::abs(s.sin - std::sin(2 * M_PI * turns)));
        worst = std::max(worst, std::abs(s.cos - std::cos(2 * M_PI * turns)));
    }
    EXPECT_LT(worst, 2e-7);
    EXPECT_EQ(sinCosOfTurns(.25f).cos, 0);
    EXPECT_EQ(sinCosOfTurns(.5f).sin, 0);
    EXPECT_EQ(sinCosOfTurns(-.25f).sin, -1);
}
