#include "core/math/sampling.h"
#include "support/chi_square.h"

#include <gtest/gtest.h>

#include <functional>

using namespace strobe;
using namespace strobe::test;

namespace {

constexpr int kSamples = 100000;
constexpr double kAlpha = 1e-4; ///< significance level; tests are deterministic

/// Returns a grid of n x n points that includes the edges, corners and center of the unit square.
std::vector<V2f> gridPoints(int n = 65) {
    std::vector<V2f> points;
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
            points.push_back({std::min(float(x) / float(n - 1), kOneMinusEpsilon),
                              std::min(float(y) / float(n - 1), kOneMinusEpsilon)});
    return points;
}

/// Returns the p-value of a chi-square test of warped samples, in bins of z and φ, against the integral of
/// the pdf.
double directionPValue(const std::function<V3f(const V2f&)>& warp,
                       const std::function<double(double)>& pdfOfZ, float zMin) {
    constexpr int nz = 16, np = 16, sub = 64;
    std::vector<double> counts(nz * np), expected(nz * np);
    for (int i = 0; i < kSamples; ++i) {
        const V3f w = warp(random2D(7, i));
        const float phi = std::atan2(w.y, w.x) / (2 * kPi) + .5f;
        const int z = std::clamp(int((w.z - zMin) / (1 - zMin) * nz), 0, nz - 1);
        counts[z * np + std::min(int(phi * np), np - 1)] += 1;
    }
    for (int z = 0; z < nz; ++z) {
        double mass = 0;
        for (int s = 0; s < sub; ++s)
            mass += pdfOfZ(zMin + (1 - zMin) * (z + (s + .5) / sub) / nz) / sub;
        for (int p = 0; p < np; ++p)
            expected[z * np + p] = kSamples * mass * (1 - zMin) / nz * 2 * M_PI / np;
    }
    double total = 0;
    for (const double e : expected)
        total += e;
    EXPECT_NEAR(total / kSamples, 1, 1e-5) << "the density does not integrate to 1";
    return chiSquareP(counts, expected);
}

void expectNear(const V2f& a, const V2f& b, float tolerance) {
    EXPECT_NEAR(a.x, b.x, tolerance) << b;
    EXPECT_NEAR(a.y, b.y, tolerance) << b;
}

} // namespace

TEST(ChiSquare, TailMatchesPublishedTables) {
    EXPECT_NEAR(chiSquareTail(3.841, 1), 0.05, 1e-4);
    EXPECT_NEAR(chiSquareTail(18.307, 10), 0.05, 1e-4);
    EXPECT_NEAR(chiSquareTail(124.342, 100), 0.05, 1e-4);
    EXPECT_NEAR(chiSquareTail(77.929, 100), 0.95, 1e-4);
}

TEST(Sampling, SinQuarterAndCosQuarterHaveFloatPrecision) {
    for (float x = -kPi / 4; x <= kPi / 4; x += 1e-4f) {
        EXPECT_NEAR(sinQuarter(x), std::sin(double(x)), 1.2e-7);
        EXPECT_NEAR(cosQuarter(x), std::cos(double(x)), 1.2e-7);
    }
}

TEST(Sampling, ConcentricDiskIsUniformAndInvertible) {
    for (const V2f& u : gridPoints()) {
        const V2f p = concentricDisk(u);
        EXPECT_LE(p.length(), 1 + 1e-6f);
        expectNear(concentricDiskInverse(p), u, 2e-6f);
    }
    constexpr int nr = 12, np = 24;
    std::vector<double> counts(nr * np), expected(nr * np, double(kSamples) / (nr * np));
    for (int i = 0; i < kSamples; ++i) {
        const V2f p = concentricDisk(random2D(3, i));
        const int r = std::min(int(p.length2() * nr), nr - 1); // equal areas
        counts[r * np + std::min(int((std::atan2(p.y, p.x) / (2 * kPi) + .5f) * np), np - 1)] += 1;
    }
    EXPECT_GT(chiSquareP(counts, expected), kAlpha);
}

TEST(Sampling, CosineHemisphereMatchesItsPdfAndInverse) {
    for (const V2f& u : gridPoints()) {
        const V3f w = cosineHemisphere(u);
        EXPECT_NEAR(length(w), 1, 1e-6f);
        EXPECT_GE(w.z, 0);
        expectNear(cosineHemisphereInverse(w), u, 2e-6f);
    }
    EXPECT_GT(directionPValue(
                  cosineHemisphere, [](double z) { return cosineHemispherePdf(float(z)); }, 0),
              kAlpha);
    EXPECT_EQ(cosineHemispherePdf(-.5f), 0);
}

TEST(Sampling, UniformSphereAndHemisphereMatchTheirPdfsAndInverses) {
    for (const V2f& u : gridPoints()) {
        const V3f w = uniformSphere(u), h = uniformHemisphere(u);
        EXPECT_NEAR(length(w), 1, 2e-6f);
        EXPECT_NEAR(length(h), 1, 1e-6f);
        EXPECT_GE(h.z, -1e-6f);
        expectNear(uniformHemisphereInverse(h), u, 4e-6f);
        if (w.z > -.9999f) // near the pole, the inverse is ill-conditioned: the pole maps to the border of
                           // the square
            expectNear(uniformSphereInverse(w), u, 2e-4f);
    }
    EXPECT_GT(directionPValue(
                  uniformSphere, [](double) { return kUniformSpherePdf; }, -1),
              kAlpha);
    EXPECT_GT(directionPValue(
                  uniformHemisphere, [](double) { return kUniformHemispherePdf; }, 0),
              kAlpha);
}

TEST(Sampling, UniformConeMatchesItsPdfAndInverseForAllWidths) {
    for (const float width : {2.f, 1.3f, .5f, 1e-2f, 1e-6f, 1e-12f}) {
        for (const V2f& u : gridPoints(17)) {
            const V3f w = uniformCone(u, width);
            EXPECT_NEAR(length(w), 1, 2e-6f);
            EXPECT_GE(w.z, 1 - width - 1e-6f);
            if (w.z > -.999f)
                expectNear(uniformConeInverse(w, width), u, 1e-4f);
        }
        // At the rim of the cone, sin²θ = x(2-x), even if cosθ rounds to 1.
        const V3f rim = uniformCone({kOneMinusEpsilon, .5f}, width);
        const double sin2 = double(width) * (2 - double(width));
        EXPECT_NEAR(rim.x * rim.x + rim.y * rim.y, sin2, 1e-5 * sin2 + 1e-6 * width);
    }
    EXPECT_GT(directionPValue([](const V2f& u) { return uniformCone(u, .7f); },
                              [](double) { return uniformConePdf(.7f); }, .3f),
              kAlpha);
    EXPECT_NEAR(oneMinusCos(1e-20f) / 5e-21f, 1, 1e-6);
    EXPECT_NEAR(oneMinusCos(.75f), .5, 1e-6);
}

TEST(Sampling, UniformTriangleIsUniformAndInvertible) {
    std::vector<double> counts(64), expected(64);
    for (int i = 0; i < kSamples; ++i) {
        const V2f b = uniformTriangle(random2D(5, i));
        ASSERT_GE(std::min(b.x, b.y), 0);
        ASSERT_LE(b.x + b.y, 1 + 1e-6f);
        counts[std::min(int(b.y * 8), 7) * 8 + std::min(int(b.x * 8), 7)] += 1;
    }
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) // cells below, on and above the hypotenuse; density 2
            expected[y * 8 + x] = kSamples * 2 / 64. * (x + y < 7 ? 1 : x + y == 7 ? .5 : 0);
    EXPECT_GT(chiSquareP(counts, expected), kAlpha);
    for (const V2f& u : gridPoints(33))
        expectNear(uniformTriangleInverse(uniformTriangle(u)), u, 2e-6f);
}

TEST(Sampling, TentAndLinearMatchTheirPdfsAndInverses) {
    std::vector<double> tents(40), tentExpected(40), lines(20), lineExpected(20);
    for (int i = 0; i < kSamples; ++i) {
        const float u = random1D(11, i);
        const float t = tent(u), x = sampleLinear(u, 1, 3);
        EXPECT_NEAR(tentInverse(t), u, 2e-6);
        EXPECT_NEAR(linearInverse(x, 1, 3), u, 2e-6);
        tents[std::clamp(int((t + 1) * 20), 0, 39)] += 1;
        lines[std::min(int(x * 20), 19)] += 1;
    }
    for (int i = 0; i < 40; ++i)
        tentExpected[i] = kSamples / 20. * tentPdf((float(i) + .5f) / 20 - 1);
    for (int i = 0; i < 20; ++i)
        lineExpected[i] = kSamples / 20. * linearPdf((float(i) + .5f) / 20, 1, 3);
    EXPECT_GT(chiSquareP(tents, tentExpected), kAlpha);
    EXPECT_GT(chiSquareP(lines, lineExpected), kAlpha);
    EXPECT_EQ(sampleLinear(0, 0, 1), 0);
    EXPECT_NEAR(sampleLinear(.25f, 0, 1), .5, 1e-6);
    EXPECT_NEAR(sampleLinear(.75f, 1, 0), .5, 1e-6);
}

TEST(Sampling, BilinearMatchesItsPdfAndInverse) {
    const Bilinear f{1, 0, 2, 5};
    std::vector<double> counts(100), expected(100);
    for (int i = 0; i < kSamples; ++i) {
        const V2f u = random2D(13, i), p = f.sample(u);
        expectNear(f.inverse(p), u, 1e-5f);
        counts[std::min(int(p.y * 10), 9) * 10 + std::min(int(p.x * 10), 9)] += 1;
    }
    for (int i = 0; i < 100; ++i)
        expected[i] = kSamples / 100. * f.pdf({(float(i % 10) + .5f) / 10, (float(i / 10) + .5f) / 10});
    EXPECT_GT(chiSquareP(counts, expected), kAlpha);
}

TEST(Sampling, PowerHeuristicHasKnownValues) {
    EXPECT_FLOAT_EQ(powerHeuristic(1, 2, 1, 1), .8f);
    EXPECT_FLOAT_EQ(powerHeuristic(2, 1, 1, 2), .5f);
    EXPECT_EQ(powerHeuristic(1, 0, 1, 0), 0);
    EXPECT_EQ(powerHeuristic(1, kInfinity, 1, 5), 1);
    EXPECT_FLOAT_EQ(powerHeuristic(1, 1e30f, 1, 1e30f), .5f);
    EXPECT_FLOAT_EQ(powerHeuristic(1, 3, 4, 2) + powerHeuristic(4, 2, 1, 3), 1);
}

TEST(Sampling, Piecewise1DMatchesItsPdfAndInverse) {
    const std::vector<float> values{0, 1, 0, 0, 5, 2.5f, 0};
    const Piecewise1D density(values);
    EXPECT_NEAR(density.integral(), 8.5 / 7, 1e-6);
    std::vector<double> counts(7), expected(7);
    for (int i = 0; i < kSamples; ++i) {
        const float u = random1D(17, i), x = density.sample(u);
        float remapped;
        const uint32_t index = density.sampleIndex(u, &remapped);
        ASSERT_GT(values[index], 0);
        ASSERT_TRUE(remapped >= 0 && remapped < 1);
        EXPECT_EQ(index, uint32_t(x * 7));
        EXPECT_NEAR(density.inverse(x), u, 2e-6);
        EXPECT_FLOAT_EQ(density.pdf(x), density.probability(index) * 7);
        counts[index] += 1;
    }
    for (int i = 0; i < 7; ++i)
        expected[i] = kSamples * values[i] / 8.5;
    EXPECT_GT(chiSquareP(counts, expected), kAlpha);
    EXPECT_GT(values[density.sampleIndex(0)], 0);
    EXPECT_GT(values[density.sampleIndex(kOneMinusEpsilon)], 0);
    const Piecewise1D single({3.f});
    EXPECT_FLOAT_EQ(single.sample(.25f), .25f);
    const Piecewise1D zero({0.f, 0.f});
    EXPECT_EQ(zero.integral(), 0);
    EXPECT_FLOAT_EQ(zero.sample(.75f), .75f);
    EXPECT_FLOAT_EQ(zero.pdf(.75f), 1);
}

TEST(Sampling, FindIntervalFindsBothEndsOfEachInterval) {
    for (uint32_t n = 1; n < 40; ++n) {
        std::vector<float> cdf(n + 1);
        for (uint32_t i = 0; i <= n; ++i)
            cdf[i] = float(i) / float(n);
        for (uint32_t i = 0; i < n; ++i) {
            EXPECT_EQ(findInterval(cdf.data(), n, cdf[i]), i);
            EXPECT_EQ(findInterval(cdf.data(), n, std::nextafter(cdf[i + 1], 0.f)), i);
        }
    }
}

TEST(Sampling, FindGuidedEqualsFindInterval) {
    for (uint32_t n = 1; n < 60; ++n) {
        // Some intervals are empty, some are tiny, and one contains nearly everything.
        std::vector<float> cdf(n + 1);
        for (uint32_t i = 0; i < n; ++i)
            cdf[i + 1] = cdf[i] + (i % 3 == 0 ? 0 : i == n / 2 ? 1000 : i % 5 == 0 ? 1e-6f : 1.f);
        for (float& c : cdf)
            c = cdf[n] > 0 ? c / cdf[n] : 0;
        cdf[n] = 1;
        std::vector<uint32_t> guide(n);
        makeGuide(cdf.data(), n, guide.data());
        const auto expectSame = [&](float u) {
            ASSERT_EQ(findGuided(cdf.data(), guide.data(), n, u), findInterval(cdf.data(), n, u)) << u;
        };
        for (int i = 0; i < 3000; ++i)
            expectSame(random1D(18, i));
        for (const float c : cdf)
            for (const float u : {std::nextafter(c, 0.f), c, std::nextafter(c, 1.f)})
                if (u >= 0 && u < 1)
                    expectSame(u);
    }
}

TEST(Sampling, Piecewise2DMatchesItsPdfAndInverse) {
    constexpr uint32_t nx = 6, ny = 5;
    std::vector<float> values(nx * ny);
    for (uint32_t i = 0; i < nx * ny; ++i)
        values[i] = i % 3 == 0 ? 0 : float(1 << (i % 8));
    for (uint32_t x = 0; x < nx; ++x)
        values[2 * nx + x] = 0; // a row that is never sampled
    const Piecewise2D density(values, nx, ny);
    std::vector<double> counts(nx * ny), expected(nx * ny);
    double sum = 0;
    for (const float v : values)
        sum += v;
    EXPECT_NEAR(density.integral(), sum / (nx * ny), 1e-5);
    for (int i = 0; i < kSamples; ++i) {
        const V2f u = random2D(19, i), p = density.sample(u);
        const uint32_t cell = uint32_t(p.y * ny) * nx + uint32_t(p.x * nx);
        EXPECT_NEAR(density.pdf(p), values[cell] * nx * ny / sum, 1e-4);
        ASSERT_GT(density.pdf(p), 0);
        expectNear(density.inverse(p), u, 1e-5f);
        counts[cell] += 1;
    }
    for (uint32_t i = 0; i < nx * ny; ++i)
        expected[i] = kSamples * values[i] / sum;
    EXPECT_GT(chiSquareP(counts, expected), kAlpha);
}

TEST(Sampling, Piecewise2DSoAEqualsScalar) {
    std::vector<float> values;
    for (int i = 0; i < 30; ++i)
        values.push_back(i % 3 == 0 ? 0 : float(1 << (i % 8)));
    const Piecewise2D density(values, 6, 5);
    V2SoA u;
    Piecewise2D::CellSample samples[kSoAWidth];
    for (int i = 0; i < kSoAWidth; ++i)
        u.set(i, random2D(20, i));
    density.sampleCellSoA(u, kSoAWidth, samples);
    for (int i = 0; i < kSoAWidth; ++i) {
        const Piecewise2D::CellSample expected = density.sampleCell(u.at(i));
        EXPECT_EQ(samples[i].x, expected.x);
        EXPECT_EQ(samples[i].y, expected.y);
        EXPECT_EQ(samples[i].offset, expected.offset);
    }
}

TEST(Sampling, PiecewiseLinear1DMatchesItsPdfAndInverse) {
    const std::vector<float> nodes{0, 1, 4, 0, 0, 2};
    const PiecewiseLinear1D density(nodes);
    EXPECT_NEAR(density.integral(), (0.5 + 2.5 + 2 + 0 + 1) / 5, 1e-6);
    constexpr int bins = 50;
    std::vector<double> counts(bins), expected(bins);
    for (int i = 0; i < kSamples; ++i) {
        const float u = random1D(23, i), x = density.sample(u);
        EXPECT_NEAR(density.inverse(x), u, 2e-6);
        counts[std::min(int(x * bins), bins - 1)] += 1;
    }
    for (int i = 0; i < bins; ++i)
        expected[i] = double(kSamples) / bins * density.pdf((float(i) + .5f) / bins);
    EXPECT_GT(chiSquareP(counts, expected), kAlpha);
}
