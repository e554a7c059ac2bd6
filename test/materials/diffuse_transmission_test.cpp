#include "core/math/sampling.h"
#include "materials/diffuse_transmission.h"
#include "materials/material_fixture.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

MaterialPtr transmission(float reflectance, float transmittance) {
    return makeMaterial(diffuseTransmissionPlugin(), {rgbParam("reflectance", Rgb(reflectance)),
                                                      rgbParam("transmittance", Rgb(transmittance))});
}

/// Calls check(bsdf, wo) for some materials and directions on both sides.
template <class Check>
void forAll(const Check& check) {
    for (const auto& [r, t] : {std::pair(.25f, .5f), {.5f, .5f}, {0.f, .8f}, {.6f, 0.f}}) {
        const MaterialPtr material = transmission(r, t);
        for (const V3f& wo : viewDirections())
            check(*material, prepared(*material), wo, r, t);
    }
}

/// Samples fall on each side in proportion to its albedo, and on each side with a density of cos/π: cos² is
/// uniform.
TEST(DiffuseTransmission, SamplesFollowThePdf) {
    constexpr int kCount = 20000, kBins = 16;
    forAll([&](const Material& material, const Bsdf& bsdf, const V3f& wo, float r, float t) {
        std::vector<double> counts(2 * kBins);
        Random random(7);
        for (int i = 0; i < kCount; ++i) {
            BsdfSample s;
            const float uc = random.next();
            ASSERT_TRUE(material.sample(bsdf, wo, uc, random.next2(), s));
            EXPECT_EQ(s.transmits, wo.z * s.wi.z < 0);
            ++counts[size_t(s.transmits ? kBins : 0) + size_t(std::min(int(sqr(s.wi.z) * kBins), kBins - 1))];
        }
        double x = 0;
        int bins = 0;
        for (int i = 0; i < 2 * kBins; ++i) {
            const double expected = kCount * double(i < kBins ? r : t) / (r + t) / kBins;
            if (expected == 0) {
                EXPECT_EQ(counts[size_t(i)], 0);
                continue;
            }
            x += sqr(counts[size_t(i)] - expected) / expected;
            ++bins;
        }
        EXPECT_GT(chiSquareTail(x, bins - 1), 1e-5) << r << " " << t << " " << wo.z;
    });
}

TEST(DiffuseTransmission, SampleAgreesWithEvalCos) {
    forAll([&](const Material& material, const Bsdf& bsdf, const V3f& wo, float, float) {
        Random random(3);
        for (int i = 0; i < 100; ++i) {
            BsdfSample s;
            const float uc = random.next();
            ASSERT_TRUE(material.sample(bsdf, wo, uc, random.next2(), s));
            Rgb f;
            float pdf = 0;
            material.evalCos(bsdf, wo, &s.wi, 1, &f, &pdf);
            EXPECT_NEAR(pdf, s.pdf, 1e-6f);
            EXPECT_NEAR(f.x / pdf, s.weight.x, 1e-5f);
            EXPECT_LE(pdf, material.maxPdf(bsdf, wo));
        }
    });
}

/// The albedo is the sum of both, and f(wo, wi) = f(wi, wo) on both sides.
TEST(DiffuseTransmission, ConservesEnergyAndIsReciprocal) {
    forAll([&](const Material& material, const Bsdf& bsdf, const V3f& wo, float r, float t) {
        Random random(5);
        double sum = 0;
        constexpr int kCount = 40000;
        for (int i = 0; i < kCount; ++i) {
            const V3f wi = random.direction();
            Rgb f, back;
            material.evalCos(bsdf, wo, &wi, 1, &f, nullptr);
            material.evalCos(bsdf, wi, &wo, 1, &back, nullptr);
            EXPECT_NEAR(f.x * std::abs(wo.z), back.x * std::abs(wi.z), 1e-6f);
            sum += double(f.x) * 4 * kPi / kCount;
        }
        EXPECT_NEAR(sum, r + t, .02);
    });
    const MaterialPtr tooBright = transmission(2, 2);
    BsdfSample s;
    ASSERT_TRUE(tooBright->sample(prepared(*tooBright), {0, 0, 1}, .7f, {.5f, .5f}, s));
    EXPECT_NEAR(s.weight.x, 1, 1e-5f);
}

} // namespace
} // namespace strobe::test
