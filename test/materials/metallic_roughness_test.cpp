// Tests of the metallic-roughness material; smooth_materials_test.cpp tests the properties of all materials.
#include "materials/metallic_roughness.h"

#include "materials/material_fixture.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

MetallicRoughnessInputs inputs(float base, float metallic, float roughness) {
    MetallicRoughnessInputs in;
    in.baseColor = Rgb(base);
    in.metallic = metallic;
    in.roughness = roughness;
    return in;
}

struct Pair {
    V3f wo, wi;
};
/// cosθ = 0.8 and 0.6 on opposite sides of the normal, so that the half vector is not the normal.
const Pair kOblique{{.6f, 0, .8f}, {-.8f, 0, .6f}};

TEST(MetallicRoughness, EqualsTheFormulasOfGltfAppendixB) {
    const auto material = makeMetallicRoughness(inputs(.5f, .25f, .6f));
    const Bsdf bsdf = prepared(*material);
    Rgb f;
    material->evalCos(bsdf, kOblique.wo, &kOblique.wi, 1, &f, nullptr);
    const double alpha = .36, a2 = alpha * alpha, hx = -.2, hz = 1.4, l = std::sqrt(hx * hx + hz * hz);
    const double nh = hz / l, vh = (.6 * hx + .8 * hz) / l;
    const double grazing = std::pow(1 - vh, 5), metal = .5 + .5 * grazing;
    const double fresnel = .04 + .96 * grazing; // of the dielectric
    const double d = a2 / (M_PI * std::pow(nh * nh * (a2 - 1) + 1, 2));
    const auto g = [&](double c) { return 2 * c / (c + std::sqrt(a2 + (1 - a2) * c * c)); };
    const double gloss = d * g(.8) * g(.6) / (4 * .8 * .6);
    const double dielectric = (1 - fresnel) * .5 / M_PI + fresnel * gloss;
    const double expected = .75 * dielectric + .25 * metal * gloss;
    EXPECT_NEAR(f.x, expected * .6, 1e-5);
}

TEST(MetallicRoughness, SpecularAndIndexScaleTheReflection) {
    auto in = inputs(0, 0, .5f); // black, so that only the reflection remains
    const auto glossOf = [&] {
        const auto material = makeMetallicRoughness(in);
        Rgb f;
        const V3f up(0, 0, 1);
        material->evalCos(prepared(*material), up, &up, 1, &f, nullptr);
        return f;
    };
    const Rgb plain = glossOf();
    in.specular = .5f;
    EXPECT_NEAR(glossOf().x / plain.x, .5f, 1e-5f);
    in.specular = 1;
    in.specularColor = Rgb(1, .25f, 0);
    EXPECT_NEAR(glossOf().y / plain.x, .25f, 1e-5f);
    EXPECT_EQ(glossOf().z, 0);
    in.specularColor = Rgb(1);
    in.ior = 2;
    EXPECT_NEAR(glossOf().x / plain.x, (1. / 9) / .04, 1e-4);
}

TEST(MetallicRoughness, MetalAndClearWallsAreSpecular) {
    const auto isSpecular = [](const MetallicRoughnessInputs& in) {
        const auto material = makeMetallicRoughness(in);
        return material->isSpecular(prepared(*material));
    };
    auto in = inputs(.5f, 1, .1f);
    EXPECT_TRUE(isSpecular(in));
    in.clearcoat = .5f;
    EXPECT_FALSE(isSpecular(in));
    in.clearcoat = 0;
    in.sheenColor = Rgb(.1f);
    EXPECT_FALSE(isSpecular(in));
    in = inputs(.5f, .9f, .1f);
    EXPECT_FALSE(isSpecular(in));
    in.transmission = 1;
    EXPECT_TRUE(isSpecular(in));
}

/// Returns the fraction of uniform light that is reflected towards wo: the mean weight of samples.
Rgb reflectedByUniformLight(const Material& material, const V3f& wo) {
    constexpr int kSamples = 20000;
    const Bsdf bsdf = prepared(material);
    Random random(3);
    Rgb sum(0);
    for (int i = 0; i < kSamples; ++i) {
        BsdfSample sample;
        if (material.sample(bsdf, wo, random.next(), random.next2(), sample))
            sum += sample.weight;
    }
    return sum / float(kSamples);
}

/// Towards grazing angles, gloss reflects more than a dark body.
TEST(MetallicRoughness, ReflectanceIsThatOfUniformLight) {
    std::vector<MetallicRoughnessInputs> materials(6, inputs(.05f, 0, .2f));
    materials[1].clearcoat = 1;
    materials[2].bodyBelowBoundary = true;
    materials[3].baseColor = Rgb(.4f, .1f, .02f);
    materials[4].roughness = .4f;
    materials[5].roughness = .7f;
    for (size_t i = 0; i < materials.size(); ++i) {
        const auto material = makeMetallicRoughness(materials[i]);
        for (const float cosine : {1.f, .6f, .3f, -.3f}) {
            const V3f wo(safeSqrt(1 - sqr(cosine)), 0, cosine);
            const Rgb expected = reflectedByUniformLight(*material, wo);
            const Rgb found = material->reflectance(prepared(*material), wo);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(found[c] / expected[c], 1, .25) << i << " " << cosine << " " << c;
        }
    }
}

TEST(MetallicRoughness, TransmissionSamplesAgreeWithEvalCos) {
    auto in = inputs(.8f, 0, .5f);
    in.transmission = .7f;
    const auto material = makeMetallicRoughness(in);
    ASSERT_TRUE(material->flags().transmissive);
    const Bsdf bsdf = prepared(*material);
    for (const V3f& wo : {V3f(0, 0, 1), normalize(V3f(1, .3f, .7f)), normalize(V3f(.5f, 0, -.4f))}) {
        constexpr int kN = 200000;
        Random random(7);
        double sampled = 0, sampled2 = 0, uniform = 0, uniform2 = 0, density = 0, transmitted = 0;
        for (int i = 0; i < kN; ++i) {
            BsdfSample s;
            const float uc = random.next();
            if (material->sample(bsdf, wo, uc, random.next2(), s)) {
                ASSERT_EQ(s.transmits, s.wi.z * wo.z < 0);
                Rgb f;
                float pdf;
                material->evalCos(bsdf, wo, &s.wi, 1, &f, &pdf);
                ASSERT_NEAR(pdf, s.pdf, 1e-4f * pdf);
                sampled += s.weight.x;
                sampled2 += sqr(s.weight.x);
                transmitted += s.transmits;
            }
            const V3f wi = random.direction();
            Rgb f;
            float pdf;
            material->evalCos(bsdf, wo, &wi, 1, &f, &pdf);
            uniform += 4 * kPi * f.x;
            uniform2 += sqr(4 * kPi * f.x);
            density += 4 * kPi * pdf;
        }
        const double a = sampled / kN, b = uniform / kN;
        const double error = std::sqrt((sampled2 / kN - a * a + uniform2 / kN - b * b) / kN);
        EXPECT_NEAR(a, b, 4 * error);
        EXPECT_LE(a, 1);
        EXPECT_NEAR(density / kN, 1, .05); // reflections below the horizon are absorbed
        EXPECT_GT(transmitted / kN, .2);
    }
}

TEST(MetallicRoughness, SmoothPanesReflectAndTransmitByFresnel) {
    auto in = inputs(.5f, 0, 0);
    in.transmission = 1;
    const auto material = makeMetallicRoughness(in);
    const Bsdf bsdf = prepared(*material);
    const V3f wo = normalize(V3f(.3f, .2f, .6f));
    const float fresnel = .04f + .96f * std::pow(1 - wo.z, 5.f);
    Rgb reflected(0), transmitted(0);
    constexpr int kN = 1000;
    for (int i = 0; i < kN; ++i) {
        BsdfSample s;
        ASSERT_TRUE(material->sample(bsdf, wo, (float(i) + .5f) / kN, V2f(.5f), s));
        ASSERT_TRUE(s.delta);
        EXPECT_EQ(s.wi, s.transmits ? -wo : V3f(-wo.x, -wo.y, wo.z));
        (s.transmits ? transmitted : reflected) += s.weight * (1.f / kN);
    }
    EXPECT_NEAR(reflected.x, fresnel, .002f);
    EXPECT_NEAR(transmitted.x, .5f * (1 - fresnel), .002f);
    Rgb f;
    float pdf;
    const V3f down = -wo;
    material->evalCos(bsdf, wo, &down, 1, &f, &pdf);
    EXPECT_EQ(f, Rgb(0));
    EXPECT_EQ(pdf, 0);
}

TEST(MetallicRoughness, MirrorsAndClearPanesAreNotSmooth) {
    const auto isSmooth = [](const auto& change) {
        MetallicRoughnessInputs in = inputs(.5f, 1, 0);
        change(in);
        return makeMetallicRoughness(in)->flags().smooth;
    };
    using In = MetallicRoughnessInputs;
    const auto makePane = [](In& in) {
        in.metallic = 0;
        in.transmission = 1;
    };
    class One : public Texture {
        Rgb rgb(const TextureQuery&) const override { return Rgb(1); }
    };
    const auto one = std::make_shared<One>();
    EXPECT_FALSE(isSmooth([](In&) {}));
    EXPECT_FALSE(isSmooth(makePane));
    EXPECT_FALSE(isSmooth([](In& in) { in.vRoughness = 0; }));
    EXPECT_FALSE(isSmooth([](In& in) { in.clearcoat = 1; }));
    EXPECT_TRUE(isSmooth([](In& in) { in.roughness = .1f; }));
    EXPECT_TRUE(isSmooth([](In& in) { in.vRoughness = .1f; }));
    EXPECT_TRUE(isSmooth([](In& in) { in.metallic = .9f; }));
    EXPECT_TRUE(isSmooth([](In& in) { in.anisotropy = .5f; }));
    EXPECT_TRUE(isSmooth([](In& in) { in.sheenColor = Rgb(.5f); }));
    EXPECT_TRUE(isSmooth([](In& in) { in.clearcoat = in.clearcoatRoughness = .5f; }));
    EXPECT_TRUE(isSmooth([&](In& in) { in.roughness.texture = one; }));
    EXPECT_TRUE(isSmooth([&](In& in) { in.metallic.texture = one; }));
    EXPECT_TRUE(isSmooth([&](In& in) { in.packed = one; }));
}

TEST(MetallicRoughness, VarnishHasDeltaLobesBesideOthers) {
    const auto hasDelta = [](float metallic, float roughness, float coat, float coatRoughness) {
        MetallicRoughnessInputs in = inputs(.5f, metallic, roughness);
        in.clearcoat = coat;
        in.clearcoatRoughness = coatRoughness;
        return makeMetallicRoughness(in)->flags().delta;
    };
    EXPECT_TRUE(hasDelta(0, 0, 0, 0));
    EXPECT_TRUE(hasDelta(0, .5f, 1, 0));
    EXPECT_FALSE(hasDelta(0, .5f, 0, 0)); // no coat
    EXPECT_FALSE(hasDelta(0, .5f, 1, .5f));
    EXPECT_FALSE(hasDelta(1, 0, 0, 0)); // no other lobes
}

/// A smooth boundary passes (1 - F(wo)) (1 - F(wi)) of the light, and a white body returns all that passes.
TEST(MetallicRoughness, BodyBelowTheBoundaryHasFresnelsTransmittanceTwice) {
    auto in = inputs(1, 0, 0);
    in.bodyBelowBoundary = true;
    const auto material = makeMetallicRoughness(in);
    const Bsdf bsdf = prepared(*material);
    const auto fresnel = [](double cosine) { return .04 + .96 * std::pow(1 - cosine, 5); };
    const auto valueAt = [&](const V3f& wo, const V3f& wi) {
        Rgb f;
        material->evalCos(bsdf, wo, &wi, 1, &f, nullptr);
        return double(f.x) / wi.z;
    };
    const V3f steep(0, .6f, .8f), grazing(.9f, .4f, .1f);
    for (const V3f& wi : {steep, normalize(grazing), V3f(0, 0, 1)}) {
        const V3f wo(0, 0, 1);
        const double mean = 1 - (.04 + .96 / 21);
        EXPECT_NEAR(valueAt(wo, wi), .96 * (1 - fresnel(wi.z)) / (mean * M_PI), 1e-5);
        EXPECT_NEAR(valueAt(wi, steep), valueAt(steep, wi), 1e-6);
    }
    for (const float cosine : {1.f, .5f, .1f}) {
        const V3f wo(std::sqrt(1 - cosine * cosine), 0, cosine);
        EXPECT_NEAR(integrate(*material, bsdf, wo).albedo, 1 - fresnel(cosine), 1e-3) << cosine;
    }
}

TEST(MetallicRoughness, AlbedoIsAtMostOne) {
    for (const float roughness : {.2f, .5f, 1.f})
        for (const auto& [base, metallic] : {std::pair{1.f, 1.f}, {.7f, 0.f}})
            for (const float cosine : {1.f, .7f, .4f}) {
                const auto material = makeMetallicRoughness(inputs(base, metallic, roughness));
                const V3f wo(std::sqrt(1 - cosine * cosine), 0, cosine);
                EXPECT_LE(integrate(*material, prepared(*material), wo).albedo, 1.0005)
                    << base << " " << metallic << " " << roughness << " " << cosine;
            }
}

} // namespace
} // namespace strobe::test
