// Properties of all materials with smooth lobes.
#include "materials/material_fixture.h"
#include "materials/matte.h"
#include "materials/metal.h"
#include "materials/metallic_roughness.h"
#include "materials/mirror.h"
#include "materials/plastic.h"

#include <gtest/gtest.h>

#include <cstring>

namespace strobe::test {
namespace {

constexpr double kAlpha = 0.001;

class SmoothMaterials : public testing::Test {
  protected:
    /// Calls check(material, bsdf, wo) for every material and viewing direction.
    template <class Check>
    void forAll(Check check) const {
        for (const NamedMaterial& m : all())
            for (const V3f& wo : viewDirections()) {
                SCOPED_TRACE(m.name + ", wo.z = " + std::to_string(wo.z));
                check(m, prepared(*m.material), wo);
            }
    }
    static const std::vector<NamedMaterial>& all() {
        static const std::vector<NamedMaterial> materials = smoothMaterials();
        return materials;
    }
    static int count() { return int(all().size() * viewDirections().size()); }
};

/// Counts of samples per bin; the last bin counts absorbed samples.
struct Histogram {
    std::vector<double> counts = std::vector<double>(Integrals::kRows * Integrals::kColumns + 1);
    double albedo = 0, variance = 0;
};

Histogram sampleHistogram(const Material& material, const Bsdf& bsdf, const V3f& wo, int n) {
    Histogram h;
    Random random(12345);
    double sum = 0, sum2 = 0;
    for (int i = 0; i < n; ++i) {
        BsdfSample s;
        const float uc = random.next();
        const bool drawn = material.sample(bsdf, wo, uc, random.next2(), s);
        ++h.counts[drawn ? size_t(Integrals::binOf(s.wi)) : h.counts.size() - 1];
        const double w = drawn ? s.weight.y : 0;
        sum += w;
        sum2 += w * w;
    }
    h.albedo = sum / n;
    h.variance = std::max(0., sum2 / n - h.albedo * h.albedo) / n;
    return h;
}

double chiSquarePValue(const Histogram& h, const Integrals& expected, int n) {
    double x = 0, pooledCount = 0, pooledExpected = 0;
    int bins = 0;
    for (size_t i = 0; i < h.counts.size(); ++i) {
        const double e =
            n * (i < expected.pdf.size() ? expected.pdf[i] : std::max(0., 1 - expected.pdfTotal));
        if (e < 10) {
            pooledCount += h.counts[i];
            pooledExpected += e;
            continue;
        }
        x += (h.counts[i] - e) * (h.counts[i] - e) / e;
        ++bins;
    }
    // Rare bins are pooled. The lower limit of 5 suppresses quadrature errors of a fraction of a sample.
    if (pooledExpected > 5 || pooledCount > 10) {
        x += (pooledCount - pooledExpected) * (pooledCount - pooledExpected) / std::max(pooledExpected, 5.);
        ++bins;
    }
    return bins > 1 ? chiSquareTail(x, bins - 1) : 1;
}

TEST_F(SmoothMaterials, SoAMethodsEqualScalarMethods) {
    for (const NamedMaterial& m : all()) {
        SCOPED_TRACE(m.name);
        // Points with different viewing directions and one, two or three jobs each.
        constexpr int kPoints = 30;
        std::vector<Bsdf> bsdfs(kPoints, prepared(*m.material));
        Random random(77);
        V3SoA wo, wi;
        V3f views[kPoints];
        V2SoA u;
        float uc[kSoAWidth], pdf[kSoAWidth];
        int32_t point[kSoAWidth], mask[kSoAWidth];
        for (int i = 0; i < kPoints; ++i)
            views[i] = random.direction();
        for (int i = 0; i < kSoAWidth; ++i) {
            point[i] = (i + i / 4) % 80 * kPoints / 80;
            wo.set(i, views[point[i]]);
            wi.set(i, random.direction());
            mask[i] = i % 7 != 3;
            uc[i] = random.next();
            u.set(i, random.next2());
        }
        const BsdfQuerySoA jobs{bsdfs.data(), point, wo, 5, kSoAWidth - 2, mask};
        RgbSoA f;
        BsdfSampleSoA drawn, directions;
        float bound[kSoAWidth];
        m.material->evalCosSoA(jobs, wi, f, pdf);
        m.material->sampleSoA(jobs, uc, u, drawn);
        m.material->sampleDirectionSoA(jobs, uc, u, directions);
        m.material->maxPdfSoA(jobs, bound);
        for (int i = jobs.begin; i < jobs.end; ++i) {
            if (!mask[i])
                continue;
            const V3f view = wo.at(i), light = wi.at(i);
            Rgb value;
            float density;
            m.material->evalCos(bsdfs[0], view, &light, 1, &value, &density);
            EXPECT_EQ(f.at(i), value);
            EXPECT_EQ(pdf[i], density);
            EXPECT_EQ(bound[i], m.material->maxPdf(bsdfs[0], view));
            BsdfSample s;
            ASSERT_EQ(drawn.valid[i], m.material->sample(bsdfs[0], view, uc[i], u.at(i), s));
            if (!drawn.valid[i])
                continue;
            EXPECT_TRUE(directions.valid[i]);
            EXPECT_EQ(directions.wi.at(i), s.wi);
            EXPECT_EQ(drawn.wi.at(i), s.wi);
            EXPECT_EQ(drawn.weight.at(i), s.weight);
            EXPECT_EQ(drawn.pdf[i], s.pdf);
            EXPECT_EQ(drawn.delta[i], s.delta);
            EXPECT_EQ(drawn.transmits[i], s.transmits);
        }
    }
}

/// A texture that varies linearly in uv.
class Gradient : public Texture {
  public:
    Rgb rgb(const TextureQuery& q) const override { return {.1f + .8f * q.uv.x, .5f, .1f + .8f * q.uv.y}; }
};

TEST(TexturedMaterials, EvalCosSoAUsesTheDataOfEachPoint) {
    const auto table = std::make_shared<TextureTable>();
    table->rgbs = table->floats = {std::make_shared<Gradient>()};
    const auto textured = [&](const MaterialPlugin& plugin, const std::vector<std::string>& names) {
        return texturedMaterial(plugin, names, table);
    };
    for (const MaterialPtr& material :
         {textured(mattePlugin(), {"Kd", "sigma"}), textured(plasticPlugin(), {"Kd", "Ks", "roughness"}),
          textured(metalPlugin(), {"eta", "roughness"})}) {
        Random random(78);
        std::vector<Bsdf> bsdfs(kSoAWidth);
        V3SoA wo, wi;
        int32_t point[kSoAWidth];
        for (int i = 0; i < kSoAWidth; ++i) {
            TextureQuery q;
            q.uv = random.next2();
            bsdfs[size_t(i)].material = material.get();
            material->prepare(q, bsdfs[size_t(i)]);
            point[i] = kSoAWidth - 1 - i;
            wo.set(i, random.direction());
            wi.set(i, random.direction());
        }
        RgbSoA f;
        float pdf[kSoAWidth];
        material->evalCosSoA({bsdfs.data(), point, wo, 0, kSoAWidth, nullptr}, wi, f, pdf);
        for (int i = 0; i < kSoAWidth; ++i) {
            const V3f light = wi.at(i);
            Rgb value;
            float density;
            material->evalCos(bsdfs[size_t(point[i])], wo.at(i), &light, 1, &value, &density);
            EXPECT_EQ(f.at(i), value);
            EXPECT_EQ(pdf[i], density);
        }
    }
}

TEST_F(SmoothMaterials, SamplesFollowThePdfAndEstimateTheAlbedo) {
    const double level = sidakLevel(kAlpha, 2 * count());
    forAll([&](const NamedMaterial& m, const Bsdf& bsdf, const V3f& wo) {
        constexpr int kN = 40000;
        const Integrals integrals = integrate(*m.material, bsdf, wo);
        const Histogram h = sampleHistogram(*m.material, bsdf, wo, kN);
        EXPECT_LE(integrals.pdfTotal, 1 + 1e-4);
        EXPECT_GT(chiSquarePValue(h, integrals, kN), level);
        // A z-test of the importance-sampled albedo against the quadrature.
        const double difference = h.albedo - integrals.albedo;
        const double slack = 1e-4 * integrals.albedo + 1e-9; // error of the quadrature
        const double z = std::max(0., std::abs(difference) - slack) / std::sqrt(h.variance + 1e-18);
        EXPECT_GT(std::erfc(z / std::sqrt(2)), level) << h.albedo << " instead of " << integrals.albedo;
        if (m.conservesEnergy) {
            EXPECT_LE(integrals.albedo, 1 + 1e-3);
        }
    });
}

TEST_F(SmoothMaterials, UniformSamplingGivesTheSameAlbedo) {
    const double level = sidakLevel(kAlpha, count());
    forAll([&](const NamedMaterial& m, const Bsdf& bsdf, const V3f& wo) {
        if (m.isSharp)
            return; // uniform samples rarely hit the lobe
        constexpr int kN = 40000;
        const Histogram h = sampleHistogram(*m.material, bsdf, wo, kN);
        Random random(99);
        double sum = 0, sum2 = 0;
        for (int i = 0; i < kN; ++i) {
            V3f wi = random.direction();
            wi.z = std::copysign(wi.z, wo.z);
            Rgb f;
            float pdf;
            m.material->evalCos(bsdf, wo, &wi, 1, &f, &pdf);
            sum += 2 * kPi * f.y;
            sum2 += sqr(2 * kPi * f.y);
        }
        const double mean = sum / kN, variance = std::max(0., sum2 / kN - mean * mean) / kN + h.variance;
        const double z = std::max(0., std::abs(mean - h.albedo) - 1e-4 * mean) / std::sqrt(variance + 1e-18);
        EXPECT_GT(std::erfc(z / std::sqrt(2)), level) << h.albedo << " and " << mean;
    });
}

TEST_F(SmoothMaterials, SampleAgreesWithEvalCos) {
    forAll([&](const NamedMaterial& m, const Bsdf& bsdf, const V3f& wo) {
        Random random(3);
        for (int i = 0; i < 2000; ++i) {
            BsdfSample s;
            const float uc = random.next();
            if (!m.material->sample(bsdf, wo, uc, random.next2(), s))
                continue;
            Rgb f;
            float pdf;
            m.material->evalCos(bsdf, wo, &s.wi, 1, &f, &pdf);
            ASSERT_FALSE(s.delta);
            ASSERT_GT(s.pdf, 0);
            ASSERT_NEAR(length(s.wi), 1, 1e-5);
            ASSERT_GT(s.wi.z * wo.z, 0);
            ASSERT_NEAR(pdf, s.pdf, 1e-4f * pdf);
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(f[c] / pdf, s.weight[c], 1e-4f * s.weight[c] + 1e-7f);
        }
    });
}

TEST_F(SmoothMaterials, ReciprocalTwoSidedAndPdfOnlyAboveTheHorizon) {
    for (const NamedMaterial& m : all()) {
        SCOPED_TRACE(m.name);
        const Bsdf bsdf = prepared(*m.material);
        Random random(4);
        for (int i = 0; i < 5000; ++i) {
            const V3f wo = random.direction();
            V3f wi = random.direction();
            const V3f others[3] = {wo, -wi, wi};
            Rgb f[3], g;
            float pdf[3], density;
            m.material->evalCos(bsdf, wi, others, 1, f, pdf);
            m.material->evalCos(bsdf, wo, &wi, 1, &g, &density);
            if (wi.z * wo.z <= 0) {
                ASSERT_EQ(density, 0);
            }
            for (int c = 0; c < 3; ++c) {
                const float a = f[0][c] * std::abs(wi.z), b = g[c] * std::abs(wo.z); // f cos cos both
                ASSERT_NEAR(a, b, 1e-3f * b + 1e-9f);
                ASSERT_GE(g[c], 0);
                ASSERT_TRUE(std::isfinite(g[c]));
            }
            if (!m.isTwoSided)
                continue;
            const V3f back = -wi;
            m.material->evalCos(bsdf, -wo, &back, 1, f, pdf);
            for (int c = 0; c < 3; ++c)
                ASSERT_FLOAT_EQ(f[0][c], g[c]);
            ASSERT_FLOAT_EQ(pdf[0], density);
        }
    }
}

TEST_F(SmoothMaterials, EvalCosOfManyDirectionsEqualsSingleCalls) {
    forAll([&](const NamedMaterial& m, const Bsdf& bsdf, const V3f& wo) {
        Random random(5);
        V3f wi[37];
        Rgb f[37], single;
        float pdf[37], singlePdf;
        for (V3f& w : wi)
            w = random.direction();
        m.material->evalCos(bsdf, wo, wi, 37, f, pdf);
        for (int i = 0; i < 37; ++i) {
            m.material->evalCos(bsdf, wo, &wi[i], 1, &single, &singlePdf);
            ASSERT_EQ(single, f[i]);
            ASSERT_EQ(singlePdf, pdf[i]);
        }
    });
}

TEST_F(SmoothMaterials, MaxPdfIsATightUpperBound) {
    forAll([&](const NamedMaterial& m, const Bsdf& bsdf, const V3f& wo) {
        const float bound = m.material->maxPdf(bsdf, wo);
        Random random(6);
        float maximum = 0;
        for (int i = 0; i < 20000; ++i) {
            BsdfSample s;
            V3f wi = random.direction();
            const float uc = random.next();
            const V2f u = random.next2();
            if (i % 2 && m.material->sample(bsdf, wo, uc, u, s)) // near the lobe, up to .3 from the sample
                wi = normalize(s.wi + random.direction() * (.3f * random.next()));
            Rgb f;
            float pdf;
            m.material->evalCos(bsdf, wo, &wi, 1, &f, &pdf);
            maximum = std::max(maximum, pdf);
        }
        EXPECT_LE(maximum, bound);
        if (m.hasTightBound) {
            EXPECT_LE(bound, 2.5f * maximum) << "the bound is too loose";
        }
    });
}

TEST_F(SmoothMaterials, GrazingAndOppositeDirectionsGiveFiniteValues) {
    for (const NamedMaterial& m : all()) {
        SCOPED_TRACE(m.name);
        const Bsdf bsdf = prepared(*m.material);
        const V3f special[] = {{1, 0, 0},
                               {-1, 0, 0},
                               {0, 0, 1},
                               {0, 0, -1},
                               {0, 1, 0},
                               normalize(V3f(1, 0, 1e-20f)),
                               normalize(V3f(1, 0, 1e-4f)),
                               normalize(V3f(-1, 0, 1e-4f))};
        for (const V3f& wo : special) {
            for (const V3f& wi : special) {
                Rgb f;
                float pdf;
                m.material->evalCos(bsdf, wo, &wi, 1, &f, &pdf);
                EXPECT_TRUE(isFinite(f)) << wo << wi;
                EXPECT_TRUE(std::isfinite(pdf)) << wo << wi;
            }
            for (const V2f& u : {V2f(0, 0), V2f(kOneMinusEpsilon, 0), V2f(.5f, .5f), V2f(kOneMinusEpsilon)})
                for (const float uc : {0.f, .5f, kOneMinusEpsilon}) {
                    BsdfSample s;
                    if (m.material->sample(bsdf, wo, uc, u, s)) {
                        EXPECT_TRUE(isFinite(s.weight)) << wo << s.weight;
                        EXPECT_TRUE(std::isfinite(s.pdf) && s.pdf > 0) << wo;
                    }
                }
        }
    }
}

/// A texture of the colors (u, v, 0.5).
class UvTexture : public Texture {
  public:
    Rgb rgb(const TextureQuery& q) const override { return {q.uv.x, q.uv.y, .5f}; }
};

TEST_F(SmoothMaterials, PrepareSoAEqualsPrepare) {
    const auto table = std::make_shared<TextureTable>();
    table->floats.push_back(std::make_shared<UvTexture>());
    table->rgbs.push_back(table->floats[0]);
    const auto textured = [&](const MaterialPlugin& plugin, const std::vector<std::string>& names) {
        return texturedMaterial(plugin, names, table);
    };
    std::vector<MaterialPtr> materials = {textured(mattePlugin(), {"Kd"}),
                                          textured(mattePlugin(), {"Kd", "sigma"}),
                                          textured(plasticPlugin(), {"Kd"}),
                                          textured(plasticPlugin(), {"Ks", "roughness"}),
                                          textured(metallicRoughnessPlugin(), {"basecolor", "metallic"}),
                                          textured(mirrorPlugin(), {"Kr"}),
                                          makeMaterial(mirrorPlugin(), {})};
    for (const NamedMaterial& m : all())
        materials.push_back(m.material);
    V2SoA uv, none{};
    const V3SoA p{};
    const uint32_t prim[kSoAWidth] = {};
    const float barycentrics[kSoAWidth] = {};
    Random random(3);
    for (int i = 0; i < kSoAWidth; ++i)
        uv.set(i, random.next2() - V2f(.2f));
    const TextureQuerySoA q{uv, p, none, none, prim, barycentrics, barycentrics, p, barycentrics};
    for (const MaterialPtr& material : materials) {
        Bsdf prepared[kSoAWidth] = {}, expected{};
        material->prepareSoA(q, 0, 5, prepared);
        material->prepareSoA(q, 5, kSoAWidth, prepared);
        for (int i = 0; i < kSoAWidth; ++i) {
            material->prepare(q.at(i), expected);
            EXPECT_EQ(0, std::memcmp(expected.data, prepared[i].data, sizeof expected.data)) << i;
        }
    }
}

} // namespace
} // namespace strobe::test
