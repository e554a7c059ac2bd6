// Rough glass: its densities, energy and reciprocity. Smooth glass: see material_values_test.cpp.
#include "materials/glass.h"
#include "materials/material_fixture.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

MaterialPtr glass(float alphaU, float alphaV, float index) {
    GlassInputs in;
    in.uRoughness = alphaU;
    in.vRoughness = alphaV;
    in.index = index;
    return makeGlass(in);
}

/// Calls check(material, bsdf, wo) for some materials and directions on both sides.
template <class Check>
void forAll(const Check& check) {
    for (const auto& [u, v, index] : {std::tuple(.3f, .3f, 1.5f), {.6f, .2f, 1.33f}, {1.f, 1.f, 2.4f}})
        for (const V3f& wo : viewDirections()) {
            SCOPED_TRACE(std::to_string(u) + " " + std::to_string(index) +
                         ", wo.z = " + std::to_string(wo.z));
            const MaterialPtr material = glass(u, v, index);
            check(*material, prepared(*material), wo);
        }
}

TEST(RoughGlass, SamplesFollowThePdf) {
    forAll([](const Material& material, const Bsdf& bsdf, const V3f& wo) {
        constexpr int kCount = 40000;
        const Integrals expected = integrate(material, bsdf, wo);
        EXPECT_LE(expected.pdfTotal, 1.002);
        std::vector<double> counts(expected.pdf.size() + 1);
        Random random(7);
        for (int i = 0; i < kCount; ++i) {
            BsdfSample s;
            const float uc = random.next();
            const bool isDrawn = material.sample(bsdf, wo, uc, random.next2(), s);
            ++counts[isDrawn ? size_t(Integrals::binOf(s.wi)) : expected.pdf.size()];
        }
        double x = 0, pooled = 0, pooledExpected = 0;
        int bins = 0;
        for (size_t i = 0; i < counts.size(); ++i) {
            const double e = kCount * (i < expected.pdf.size() ? expected.pdf[i] : 1 - expected.pdfTotal);
            if (e < 20) {
                pooled += counts[i];
                pooledExpected += e;
                continue;
            }
            x += sqr(counts[i] - e) / e;
            ++bins;
        }
        x += sqr(pooled - pooledExpected) / std::max(pooledExpected, 20.);
        EXPECT_GT(chiSquareTail(x, bins), 1e-5);
    });
}

TEST(RoughGlass, SampleAgreesWithEvalCosAndTheBound) {
    forAll([](const Material& material, const Bsdf& bsdf, const V3f& wo) {
        Random random(3);
        const float bound = material.maxPdf(bsdf, wo);
        for (int i = 0; i < 2000; ++i) {
            BsdfSample s;
            const float uc = random.next();
            if (!material.sample(bsdf, wo, uc, random.next2(), s))
                continue;
            Rgb f;
            float pdf = 0;
            material.evalCos(bsdf, wo, &s.wi, 1, &f, &pdf);
            EXPECT_EQ(s.transmits, wo.z * s.wi.z < 0);
            EXPECT_NEAR(pdf, s.pdf, 1e-3f * pdf);
            EXPECT_NEAR(f.x / pdf, s.weight.x, 1e-3f * s.weight.x);
            EXPECT_LE(pdf, bound);
        }
    });
}

/// f is symmetric for reflection; for transmission f(wo, wi) / eta_i² is. No more light leaves than arrives:
/// the albedo of radiance from both sides, in units of n², is at most 1.
TEST(RoughGlass, IsReciprocalAndConservesEnergy) {
    forAll([](const Material& material, const Bsdf& bsdf, const V3f& wo) {
        Random random(5);
        const float index = bsdf.data[6];
        for (int i = 0; i < 2000; ++i) {
            const V3f wi = random.direction();
            Rgb f, back;
            material.evalCos(bsdf, wo, &wi, 1, &f, nullptr);
            material.evalCos(bsdf, wi, &wo, 1, &back, nullptr);
            const auto eta2 = [&](const V3f& w) { return w.z > 0 ? 1.f : sqr(index); };
            const float a = f.x / std::abs(wi.z) * eta2(wi), b = back.x / std::abs(wo.z) * eta2(wo);
            EXPECT_NEAR(a, b, 2e-3f * std::max(a, b) + 1e-5f);
        }
        double sum = 0;
        constexpr int kCount = 20000;
        for (int i = 0; i < kCount; ++i) {
            BsdfSample s;
            const float uc = random.next();
            if (material.sample(bsdf, wo, uc, random.next2(), s))
                sum += s.weight.x * (s.transmits ? sqr(s.eta) : 1) / kCount;
        }
        EXPECT_LE(sum, 1.005);
        EXPECT_GT(sum, .25); // scattering between microfacets is lost
    });
}

TEST(RoughGlass, ApproachesSmoothGlass) {
    const MaterialPtr rough = glass(.002f, .002f, 1.5f), smooth = glass(0, 0, 1.5f);
    EXPECT_TRUE(rough->flags().smooth);
    EXPECT_FALSE(smooth->flags().smooth);
    const V3f wo(.6f, 0, .8f);
    for (const float uc : {.01f, .5f}) {
        BsdfSample a, b;
        ASSERT_TRUE(rough->sample(prepared(*rough), wo, uc, {.5f, .5f}, a));
        ASSERT_TRUE(smooth->sample(prepared(*smooth), wo, uc, {.5f, .5f}, b));
        EXPECT_TRUE(b.delta && !a.delta);
        EXPECT_EQ(a.transmits, b.transmits);
        EXPECT_NEAR(dot(a.wi, b.wi), 1, 1e-3f);
        EXPECT_NEAR(a.weight.x, b.weight.x, .02f);
    }
}

TEST(RoughGlass, RoughnessIsMappedByTheVersionOfPbrt) {
    const auto alpha = [](float roughness, int version, bool remap) {
        Diagnostics quiet;
        BuildContext context{quiet};
        context.pbrtVersion = version;
        ParamSet params;
        params.add(floatParam("roughness", roughness));
        params.add({"remaproughness", ParamType::Bool, {}, {}, {remap ? 1 : 0}, {}});
        return prepared(*glassPlugin().create(params, context)).data[7];
    };
    EXPECT_FLOAT_EQ(alpha(.25f, 4, true), .5f);
    EXPECT_FLOAT_EQ(alpha(.25f, 4, false), .25f);
    const float x = std::log(.25f);
    EXPECT_FLOAT_EQ(alpha(.25f, 3, true), 1.62142f + .819955f * x + .1734f * x * x + .0171201f * x * x * x +
                                              .000640711f * x * x * x * x);
    EXPECT_EQ(alpha(0, 4, true), 0);
}

} // namespace
} // namespace strobe::test
