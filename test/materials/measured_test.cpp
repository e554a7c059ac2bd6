#include "materials/measured.h"

#include "materials/irregular_brdf.h"
#include "materials/material_fixture.h"
#include "materials/merl_brdf.h"

#include "support/scene_data.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

namespace strobe::test {
namespace {

namespace fs = std::filesystem;

/// A file that is removed after the test.
struct ScratchFile {
    fs::path path;
    ScratchFile(const std::string& name, const std::string& bytes)
        : path(fs::temp_directory_path() / ("strobe-" + std::to_string(::getpid()) + "-" + name)) {
        std::ofstream(path, std::ios::binary) << bytes;
    }
    ~ScratchFile() { fs::remove(path); }
};

V3f upperDirection(Random& random) {
    V3f w = random.direction();
    w.z = std::abs(w.z);
    return w;
}

/// Expects equality up to rounding.
void expectSame(const Rgb& a, const Rgb& b, const V3f& key) {
    for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(a[c], b[c], 1e-5f * std::abs(b[c]) + 1e-9f) << key;
}

void expectGridEqualsBruteForce(const IrregularBrdf& brdf, int n) {
    Random random(1);
    for (int i = 0; i < n; ++i) {
        const V3f key = IrregularBrdf::keyOf(upperDirection(random), upperDirection(random));
        expectSame(brdf.eval(key), brdf.evalBruteForce(key), key);
    }
    for (int i = 0; i < 1000; ++i) { // any pair, including directions on opposite sides
        const V3f key = IrregularBrdf::keyOf(random.direction(), random.direction());
        expectSame(brdf.eval(key), brdf.evalBruteForce(key), key);
    }
    for (const V3f& key :
         {V3f(0, 0, 0), V3f(1, 0, 0), V3f(1, 1, 0), V3f(0, 0, 1), V3f(0, 1, 1), V3f(1, 1, 1)})
        expectSame(brdf.eval(key), brdf.evalBruteForce(key), key);
}

/// Returns samples that are clustered like measurements: half of them near the mirror direction.
std::vector<IrregularBrdf::Sample> clusteredSamples(int n) {
    Random random(2);
    std::vector<IrregularBrdf::Sample> samples;
    for (int i = 0; i < n; ++i) {
        const V3f wi = upperDirection(random);
        V3f wo = upperDirection(random);
        if (i % 2)
            wo = normalize(V3f(-wi.x, -wi.y, wi.z) + wo * .2f);
        samples.push_back(
            {IrregularBrdf::keyOf(wo, wi), Rgb(random.next(), random.next(), 100 * random.next())});
    }
    return samples;
}

TEST(IrregularBrdf, GridEqualsBruteForce) {
    expectGridEqualsBruteForce(IrregularBrdf(clusteredSamples(700)), 30000);
    for (const int n : {1, 2, 3, 4, 20})
        expectGridEqualsBruteForce(IrregularBrdf(clusteredSamples(n)), 300);
}

TEST(IrregularBrdf, GridEqualsBruteForceOnMystique) {
    const fs::path path = test::pbrtFolder() / "brdfs/mystique.brdf";
    if (!fs::exists(path))
        GTEST_SKIP() << "the scenes of the paper are not available: set STROBE_SCENES";
    const IrregularBrdf brdf(readIrregularBrdf(path, {}));
    EXPECT_EQ(brdf.samples().size(), 1439u);
    expectGridEqualsBruteForce(brdf, 100000);
}

TEST(IrregularBrdf, KeyEqualsThatOfPbrtV2) {
    const V3f wi(std::sin(.5f), 0, std::cos(.5f));
    const V3f wo(std::sin(.8f) * std::cos(4.f), std::sin(.8f) * std::sin(4.f), std::cos(.8f));
    const V3f key = IrregularBrdf::keyOf(wo, wi);
    EXPECT_NEAR(key.x, std::sin(.5) * std::sin(.8), 1e-6);
    EXPECT_NEAR(key.y, (2 * M_PI - 4) / M_PI, 1e-6);
    EXPECT_NEAR(key.z, std::cos(.5) * std::cos(.8), 1e-6);
}

TEST(IrregularBrdf, WeightsAreGaussianWithinTheSearchRadius) {
    // For the key 0, samples at d² = .0005, .0015 and .0075 give r² = .008, which excludes d² = .0085.
    const auto sampleAt = [](double d2, float value) {
        return IrregularBrdf::Sample{V3f(0, float(std::sqrt(d2)), 0), Rgb(value)};
    };
    const IrregularBrdf brdf(
        {sampleAt(.0005, 1), sampleAt(.0015, 2), sampleAt(.0075, 3), sampleAt(.0085, 1000)});
    const double w[3] = {std::exp(-.05), std::exp(-.15), std::exp(-.75)};
    EXPECT_NEAR(brdf.eval(V3f(0)).x, (w[0] + 2 * w[1] + 3 * w[2]) / (w[0] + w[1] + w[2]), 1e-5);
}

TEST(IrregularBrdf, ReadsTheTextFormatOfPbrtV2) {
    const ScratchFile file("a.brdf",
                           "# comment\n2 # wavelengths\n400 700\n.1 0 .2 .3 1 1\n\n.5 0 .6 -.7 2 2 # x\n");
    const auto samples = readIrregularBrdf(file.path, {});
    ASSERT_EQ(samples.size(), 2u);
    EXPECT_NEAR(samples[0].value.x, 1.205, 1e-3);
    EXPECT_NEAR(samples[1].value.z, 2 * .909, 1e-3);
    EXPECT_NEAR(samples[1].key.y, .7 / M_PI, 1e-6);
}

void expectError(const std::string& name, const std::string& bytes, const std::string& message) {
    const ScratchFile file(name, bytes);
    try {
        makeMaterial(measuredPlugin(), {stringParam("filename", file.path.string())});
        FAIL() << "no error for " << name;
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find(message), std::string::npos) << e.what();
    }
}

TEST(Measured, ReportsErrorsInFiles) {
    expectError("b.brdf", "", "the first number must be the number of wavelengths");
    expectError("c.brdf", "2\n400 700\n1 2 3 4 5", "8 numbers are not a whole number of records of 6");
    expectError("d.brdf", "2\n400 700\n1 2 x", "line 3: not a number");
    expectError("e.brdf", "2\n700 400\n1 2 3 4 5 6", "the wavelengths must ascend");
    expectError("f.brdf", "-1 2 3", "number of wavelengths");
    expectError("g.binary", "abc", "the header is incomplete");
    expectError("h.binary", std::string("\2\0\0\0\2\0\0\0\2\0\0\0", 12) + "abc",
                "it has 15 bytes instead of the 204 that its header implies");
    expectError("i.binary", std::string("\0\0\0\0\2\0\0\0\2\0\0\0", 12),
                "the header gives a resolution of 0 (must be 1 to 4096)");
    expectError("j.bsdf", "", "known: .brdf");
}

std::string merlOf(int32_t cells, const std::function<double(double thetaH)>& f) {
    const int32_t size[3] = {cells, 1, 1};
    std::string bytes(reinterpret_cast<const char*>(size), sizeof(size));
    for (const double scale : {1 / 1500., 1.15 / 1500., 1.66 / 1500.})
        for (int h = 0; h < cells; ++h) {
            const double value = f(M_PI / 2 * std::pow((h + .5) / cells, 2)) / scale;
            bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
        }
    return bytes;
}

/// Returns the maximum weight of 20000 samples.
float maxWeight(const Material& material, const V3f& wo) {
    const Bsdf bsdf = prepared(material);
    Random random(8);
    float result = 0;
    for (int i = 0; i < 20000; ++i) {
        BsdfSample s;
        const float uc = random.next();
        if (material.sample(bsdf, wo, uc, random.next2(), s))
            result = std::max(result, s.weight.y);
    }
    return result;
}

TEST(Measured, ConstantBrdfsAreSampledByTheCosineOnly) {
    for (const double value : {0., .5 / M_PI}) {
        const ScratchFile file("l.binary", merlOf(1, [&](double) { return value; }));
        const auto material = makeMaterial(measuredPlugin(), {stringParam("filename", file.path.string())});
        for (const V3f& wo : viewDirections())
            EXPECT_FLOAT_EQ(material->maxPdf(prepared(*material), wo), kInvPi) << wo;
    }
}

TEST(Measured, WeightsOfGlossyBrdfsAreSmall) {
    // Sampling by the cosine only would give a maximum weight of pi f = 125.
    const ScratchFile file(
        "m.binary", merlOf(90, [](double h) { return 1002 / (8 * M_PI) * std::pow(std::cos(h), 1000); }));
    const auto material = makeMaterial(measuredPlugin(), {stringParam("filename", file.path.string())});
    for (const float cosO : {1.f, .7f, .33f, -.5f})
        EXPECT_LT(maxWeight(*material, V3f(safeSqrt(1 - sqr(cosO)), 0, cosO)), 8) << cosO;
}

/// Returns the integral of f |wi.z| by uniform directions.
double integralOf(const Material& material, const V3f& wo) {
    constexpr int kRows = 400, kColumns = 400;
    const Bsdf bsdf = prepared(material);
    double sum = 0;
    for (int i = 0; i < kRows; ++i)
        for (int j = 0; j < kColumns; ++j) {
            const float z = (float(i) + .5f) / kRows, phi = 2 * kPi * (float(j) + .5f) / kColumns;
            const V3f wi(safeSqrt(1 - z * z) * std::cos(phi), safeSqrt(1 - z * z) * std::sin(phi), z);
            Rgb f;
            material.evalCos(bsdf, wo, &wi, 1, &f, nullptr);
            sum += double(luminance(f));
        }
    return sum * 2 * M_PI / (kRows * kColumns);
}

TEST(Measured, ReflectanceIsTheIntegralOverDirections) {
    // A lobe of constant height reflects much less at grazing angles than along the normal.
    const ScratchFile file("n.binary", merlOf(90, [](double h) { return std::pow(std::cos(h), 100); }));
    const auto material = makeMaterial(measuredPlugin(), {stringParam("filename", file.path.string())});
    EXPECT_TRUE(material->flags().viewDependent);
    const Bsdf bsdf = prepared(*material);
    const V3f normal(0, 0, 1);
    const double along = integralOf(*material, normal), relative = material->reflectance(bsdf, normal).x;
    for (const float cosO : {.8f, .5f, .3f, .1f}) {
        const V3f wo(safeSqrt(1 - cosO * cosO), 0, cosO);
        const double expected = integralOf(*material, wo) / along;
        EXPECT_NEAR(material->reflectance(bsdf, wo).x / relative / expected, 1, .05) << cosO;
        EXPECT_EQ(material->reflectance(bsdf, wo), material->reflectance(bsdf, -wo)) << cosO;
    }
    const double grazing = integralOf(*material, V3f(safeSqrt(1 - sqr(.1f)), 0, .1f));
    EXPECT_LT(grazing, along / 10);
}

TEST(Measured, ReflectanceOfBlackIsPositive) {
    const ScratchFile file("o.binary", merlOf(1, [](double) { return 0; }));
    const auto material = makeMaterial(measuredPlugin(), {stringParam("filename", file.path.string())});
    for (const V3f& wo : viewDirections())
        EXPECT_EQ(material->reflectance(prepared(*material), wo), Rgb(1)) << wo;
}

TEST(Merl, IndexesByHalfAndDifferenceAngles) {
    constexpr int kH = 10, kD = 9, kP = 12;
    std::string bytes;
    const auto append = [&](const auto value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    for (const int n : {kH, kD, kP})
        append(int32_t(n));
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < kH * kD * kP; ++i)
            append(c == 2 && i == 0 ? -1. : double(i));
    const ScratchFile file("k.binary", bytes);
    const MerlBrdf brdf(file.path, {});

    // wo = wi = normal: the first cell, whose blue value is invalid (negative).
    EXPECT_EQ(brdf.eval(V3f(0, 0, 1), V3f(0, 0, 1)), Rgb(0));
    // θh = 40° at azimuth 0, θd = 35°, φd = 70°.
    const float h = radians(40), d = radians(35), p = radians(70);
    const V3f wh(std::sin(h), 0, std::cos(h)), x(std::cos(h), 0, -std::sin(h)), y(0, 1, 0);
    const V3f wi = wh * std::cos(d) + (x * std::cos(p) + y * std::sin(p)) * std::sin(d);
    const V3f wo = wh * std::cos(d) - (x * std::cos(p) + y * std::sin(p)) * std::sin(d);
    const int index =
        int(p / kPi * kP) + kP * (int(d / (kPi / 2) * kD) + kD * int(std::sqrt(h / (kPi / 2)) * kH));
    const Rgb expected(index / 1500.f, index * 1.15f / 1500, index * 1.66f / 1500);
    for (const Rgb& f : {brdf.eval(wo, wi), brdf.eval(wi, wo), brdf.eval(-wo, -wi)}) {
        EXPECT_NEAR(f.x, expected.x, 1e-5);
        EXPECT_NEAR(f.y, expected.y, 1e-5);
        EXPECT_NEAR(f.z, expected.z, 1e-5);
    }
    EXPECT_EQ(brdf.eval(wo, -wo), Rgb(0));
}

} // namespace
} // namespace strobe::test
