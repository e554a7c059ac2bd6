// Known values of each material.
#include "materials/glass.h"
#include "materials/material_fixture.h"
#include "materials/matte.h"
#include "materials/metal.h"
#include "materials/mirror.h"
#include "materials/plastic.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

V3f direction(float degrees, float phi = 0) {
    const float theta = radians(degrees);
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

Rgb evalOne(const Material& material, const V3f& wo, const V3f& wi, float* pdf = nullptr) {
    Rgb f;
    float p;
    material.evalCos(prepared(material), wo, &wi, 1, &f, pdf ? pdf : &p);
    return f;
}

TEST(Matte, LambertIsKdOverPiTimesCosine) {
    const auto m = makeMaterial(mattePlugin(), {rgbParam("Kd", Rgb(.2f, .4f, .8f))});
    const Rgb f = evalOne(*m, direction(30), direction(60, 2));
    EXPECT_FLOAT_EQ(f.x, .2f * kInvPi * .5f);
    EXPECT_FLOAT_EQ(f.z, .8f * kInvPi * .5f);
}

TEST(Matte, OrenNayarAtKnownAngles) {
    const auto m = makeMaterial(mattePlugin(), {rgbParam("reflectance", Rgb(1)), floatParam("sigma", 20)});
    const double s2 = std::pow(20 * M_PI / 180, 2), a = 1 - s2 / (2 * (s2 + .33)), b = .45 * s2 / (s2 + .09);
    // Same azimuth: alpha = 60°, beta = 30°. Opposite azimuth: the second term vanishes.
    const double expected = (a + b * std::sin(M_PI / 3) * std::tan(M_PI / 6)) / M_PI * .5;
    EXPECT_NEAR(evalOne(*m, direction(30), direction(60)).x, expected, 1e-6);
    EXPECT_NEAR(evalOne(*m, direction(30), direction(60, kPi)).x, a / M_PI * .5, 1e-6);
}

TEST(Plastic, EqualsTheFormulaOfPbrtV2) {
    const double kd = .25, ks = .5, e = 8;
    const auto m =
        makeMaterial(plasticPlugin(), {rgbParam("Kd", Rgb(float(kd))), rgbParam("Ks", Rgb(float(ks))),
                                       floatParam("roughness", float(1 / e))});
    // In one plane: wo at 20°, wi at 50° on the other side. The half vector is at 15°, 35° from both.
    const double half = 35 * M_PI / 180, h = 15 * M_PI / 180, o = 20 * M_PI / 180, i = 50 * M_PI / 180;
    const double sinT = 1.5 * std::sin(half), cosT = std::sqrt(1 - sinT * sinT), c = std::cos(half);
    const double rp = (c - 1.5 * cosT) / (c + 1.5 * cosT), rs = (1.5 * c - cosT) / (1.5 * c + cosT);
    const double d = (e + 2) / (2 * M_PI) * std::pow(std::cos(h), e);
    const double g = std::min(1., 2 * std::cos(h) * std::min(std::cos(o), std::cos(i)) / c);
    const double gloss = ks * d * g * (rp * rp + rs * rs) / 2 / (4 * std::cos(o));
    EXPECT_NEAR(evalOne(*m, direction(20), direction(50, kPi)).y, kd / M_PI * std::cos(i) + gloss, 1e-6);
}

TEST(Plastic, FresnelTermHasTotalInternalReflection) {
    // As in pbrt-v2: reflectance 1 from 41.81° between wi and the half vector, 4 % at 0°.
    const auto m = makeMaterial(
        plasticPlugin(), {rgbParam("Kd", Rgb(0)), rgbParam("Ks", Rgb(1)), floatParam("roughness", .1f)});
    // D / (4 cos) with G = 1.
    const auto shape = [](double angle) { return 12 / (2 * M_PI) / (4 * std::cos(angle)); };
    EXPECT_NEAR(evalOne(*m, direction(0), direction(0)).x, .04 * shape(0), 1e-5);
    EXPECT_NEAR(evalOne(*m, direction(42), direction(42, kPi)).x, shape(42 * M_PI / 180), 1e-5);
    EXPECT_LT(evalOne(*m, direction(41), direction(41, kPi)).x, .6f * shape(41 * M_PI / 180));
}

TEST(Metal, CopperAtNormalIncidence) {
    const auto m = makeMaterial(metalPlugin(), {floatParam("roughness", .1f)});
    const Rgb f = evalOne(*m, direction(0), direction(0));
    const double eta[3] = {.20042, .92405, 1.10221}, k[3] = {3.91294, 2.45284, 2.14219};
    for (int c = 0; c < 3; ++c) {
        const double r = (std::pow(eta[c] - 1, 2) + k[c] * k[c]) / (std::pow(eta[c] + 1, 2) + k[c] * k[c]);
        EXPECT_NEAR(f[c], r * 12 / (2 * M_PI) / 4, 1e-5);
    }
}

TEST(Mirror, SampleSoAEqualsSample) {
    const auto m = makeMaterial(mirrorPlugin(), {rgbParam("Kr", {.2f, .4f, .8f})});
    const Bsdf bsdf = prepared(*m);
    Random random(5);
    V3SoA wo;
    V2SoA u;
    float uc[kSoAWidth] = {};
    int32_t point[kSoAWidth] = {};
    for (int i = 0; i < kSoAWidth; ++i) {
        wo.set(i, random.direction());
        u.set(i, random.next2());
    }
    BsdfSampleSoA out;
    m->sampleSoA({&bsdf, point, wo, 2, kSoAWidth - 1, nullptr}, uc, u, out);
    for (int i = 2; i < kSoAWidth - 1; ++i) {
        BsdfSample s;
        ASSERT_EQ(out.valid[i], m->sample(bsdf, wo.at(i), 0, u.at(i), s));
        EXPECT_EQ(out.wi.at(i), s.wi);
        EXPECT_EQ(out.weight.at(i), s.weight);
        EXPECT_TRUE(out.delta[i] && !out.transmits[i] && out.pdf[i] == 0);
    }
}

TEST(Mirror, ReflectsOnBothSides) {
    const auto m = makeMaterial(mirrorPlugin(), {});
    for (const V3f& wo : {direction(30, 1), direction(140, 2)}) {
        BsdfSample s;
        ASSERT_TRUE(m->sample(prepared(*m), wo, .5f, V2f(.5f), s));
        EXPECT_EQ(s.wi, V3f(-wo.x, -wo.y, wo.z));
        EXPECT_EQ(s.weight, Rgb(.9f));
        EXPECT_TRUE(s.delta && !s.transmits && s.pdf == 0);
        EXPECT_EQ(evalOne(*m, wo, s.wi), Rgb(0));
    }
    EXPECT_FALSE(m->flags().smooth);
    const auto black = makeMaterial(mirrorPlugin(), {rgbParam("Kr", Rgb(0))});
    BsdfSample s;
    EXPECT_FALSE(black->sample(prepared(*black), direction(30), .5f, V2f(.5f), s));
}

TEST(Glass, ReflectsAndRefractsByFresnelAndSnell) {
    const auto m = makeMaterial(glassPlugin(), {floatParam("eta", 1.6f)});
    EXPECT_TRUE(m->flags().transmissive);
    for (const V3f& wo : {direction(0), direction(50, 1), direction(88, 2), direction(160, 3)}) {
        Random random(8);
        const double index = wo.z > 0 ? 1.6 : 1 / 1.6;
        const double c = std::abs(wo.z), cosT = std::sqrt(1 - (1 - c * c) / (index * index));
        const double rp = (index * c - cosT) / (index * c + cosT);
        const double rs = (c - index * cosT) / (c + index * cosT);
        const double fresnel = (rp * rp + rs * rs) / 2;
        int reflected = 0;
        constexpr int kN = 20000;
        for (int i = 0; i < kN; ++i) {
            BsdfSample s;
            ASSERT_TRUE(m->sample(prepared(*m), wo, random.next(), V2f(0), s));
            ASSERT_TRUE(s.delta);
            if (!s.transmits) {
                ++reflected;
                ASSERT_NEAR(s.weight.x, 1, 1e-5);
                continue;
            }
            ASSERT_NEAR(s.weight.x, 1 / (index * index),
                        1e-5); // radiance scales by the inverse squared index
            ASSERT_NEAR(s.eta, index, 1e-5);
            ASSERT_NEAR(s.wi.z, wo.z > 0 ? -cosT : cosT, 1e-5);
            ASSERT_NEAR(s.wi.x, -wo.x / index, 1e-5);
            ASSERT_NEAR(s.wi.y, -wo.y / index, 1e-5);
        }
        EXPECT_NEAR(reflected / double(kN), fresnel, 5 * std::sqrt(fresnel * (1 - fresnel) / kN));
    }
}

TEST(Glass, PbrtV2HasTotalInternalReflectionAndNoRadianceScaling) {
    const auto m = makeMaterial(glassPlugin(), {}, Conventions::PbrtV2);
    BsdfSample s;
    for (const float uc : {0.f, .5f, kOneMinusEpsilon}) {
        ASSERT_TRUE(m->sample(prepared(*m), direction(130), uc, V2f(0), s));
        EXPECT_FALSE(s.transmits);
        EXPECT_FLOAT_EQ(s.weight.x, 1);
    }
    ASSERT_TRUE(m->sample(prepared(*m), direction(20), kOneMinusEpsilon, V2f(0), s));
    EXPECT_TRUE(s.transmits);
    EXPECT_NEAR(s.weight.x, 1, 1e-5);
}

TEST(Glass, IndexMayBeASpectrum) {
    const Param named{"eta", ParamType::Spectrum, {}, {}, {}, {"glass-SF11"}};
    const Param flat{"eta", ParamType::Spectrum, {}, {400, 1.7f, 700, 1.7f}, {}, {}};
    BsdfSample s;
    for (const auto& [param, index] : {std::pair{named, 1.7847f}, {flat, 1.7f}}) {
        const auto m = makeMaterial(glassPlugin(), {param});
        ASSERT_TRUE(m->sample(prepared(*m), direction(20), kOneMinusEpsilon, V2f(0), s));
        EXPECT_NEAR(s.eta, index, 1e-5);
    }
}

} // namespace
} // namespace strobe::test
