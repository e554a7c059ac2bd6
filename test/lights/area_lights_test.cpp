// Tests of area lights: samples against pdfs, emitting sides, bounds, and closed forms of irradiance.
#include "light_scene.h"
#include "lights/diffuse_area.h"
#include "lights/mesh_light.h"
#include "support/chi_square.h"
#include "support/params.h"

#include <gtest/gtest.h>

using namespace strobe;
using namespace strobe::test;

namespace {

std::shared_ptr<Light> makeLight(const PlacedShape& shape, bool twoSided = false) {
    static Diagnostics quiet;
    return diffuseAreaLightPlugin().create(Params().rgb("L", 3, 2, 1).boolean("twosided", twoSided),
                                           BuildContext{.diagnostics = quiet}, AreaLightArgs{shape});
}

struct Case {
    std::string name;
    PlacedShape shape;
    V3f p;
    float time = 0;
    bool twoSided = false;
};

std::vector<Case> cases() {
    const auto sphere = std::make_shared<TestSphere>(1.5f);
    const auto disk = std::make_shared<TestDisk>(1.f);
    const auto ring = std::make_shared<TestDisk>(1.f, .5f);
    const M44f away = translate({3, 1, -2});
    const M44f odd = rotate({1, 2, 3}, 50) * translate({3, 1, -2});
    const M44f stretched = scale({2, .5f, 1}) * odd, mirrored = scale({1, 1, -1}) * odd;
    const M44f small = scale(V3f(.01f)) * odd;
    const auto sliding = motion({translate({0, 0, 0}), translate({1, 2, 0})});
    const auto turning = motion({M44f(), rotate({0, 1, 0}, 80) * translate({0, 1, 0})});
    const auto growing = motion({M44f(), scale(V3f(2))});

    TriangleMesh deforming = tetrahedronMesh();
    deforming.positions.push_back(deforming.positions[0]);
    deforming.positions[1][3] = {1, 1, 3};
    TriangleMesh appearing = squareMesh(); // flat at the first key
    appearing.positions.push_back(appearing.positions[0]);
    appearing.positions[0][2] = {1, -1, 0};
    TriangleMesh withNormals = squareMesh();
    withNormals.normals = {std::vector<V3f>(4, V3f(0, .3f, -1))};

    const V3f p(0, .5f, 1);
    return {
        {"sphere", placed(sphere, away), p},
        {"sphere, scaled", placed(sphere, scale(V3f(.3f)) * away), p},
        {"sphere, tiny", placed(sphere, small), p},
        {"sphere, mirrored", placed(sphere, mirrored), p},
        {"sphere, seen from close by", placed(sphere, away), V3f(3, 1, -2) + V3f(0, 1.52f, 0)},
        {"sphere, from inside", placed(sphere, away, nullptr, true), {3.5f, 1, -1.5f}},
        {"sphere, from inside, two-sided", placed(sphere, away), {3.5f, 1, -1.5f}, 0, true},
        {"sphere, sliding", placed(sphere, away, sliding), p, .7f},
        {"sphere, turning", placed(sphere, away, turning), p, .3f},
        {"sphere, growing", placed(sphere, scale(V3f(.5f)) * away, growing), p, .6f},
        {"ellipsoid", placed(sphere, stretched), p},
        {"ellipsoid, two-sided", placed(sphere, stretched), p, 0, true},
        {"ellipsoid, moving", placed(sphere, scale({1, .5f, 1}) * away, turning), p, .4f},
        {"ellipsoid, from inside", placed(sphere, scale({2, .5f, 1}), nullptr, true), {.5f, .2f, -.3f}},
        {"disk", placed(disk, rotate({1, 0, 0}, 160) * translate({0, 0, 3})), p},
        {"disk, from behind, two-sided", placed(disk, translate({0, 0, 3})), p, 0, true},
        {"disk, stretched", placed(disk, stretched), p},
        {"disk, mirrored", placed(disk, mirrored, nullptr, true), p},
        {"disk, reversed", placed(disk, translate({0, 0, 3}), nullptr, true), p},
        {"ring, turning", placed(ring, away, turning), p, .8f},
        {"square", placed(squareMesh(), rotate({1, 0, 0}, 170) * translate({0, 0, 3})), p},
        {"square, mirrored", placed(squareMesh(), scale({1, 1, -1}) * translate({0, 0, 3})), p},
        {"square, reversed", placed(squareMesh(), translate({0, 0, 3}), nullptr, true), p},
        {"square, turned by its vertex normals", placed(withNormals, translate({0, 0, 3})), p},
        {"square, appearing", placed(appearing, rotate({0, 1, 0}, 180) * translate({0, 0, 3})), p, .5f},
        {"tetrahedron", placed(tetrahedronMesh(), odd), p},
        {"tetrahedron, stretched", placed(tetrahedronMesh(), stretched), p},
        {"tetrahedron, moving", placed(tetrahedronMesh(), odd, turning), p, .6f},
        {"tetrahedron, deforming", placed(deforming, stretched, sliding), p, .6f, true},
        {"tetrahedron, from inside", placed(tetrahedronMesh(), {}, nullptr, true), {.2f, .4f, .3f}},
    };
}

/// Bins in (z, φ) over a cone of directions that encloses a light tightly.
struct ConeBins {
    Frame frame;
    float oneMinusCosMax;
    int bin(const V3f& w, int nz, int np) const {
        const V3f l = frame.toLocal(w);
        const V2f u = uniformConeInverse(l, oneMinusCosMax);
        return std::min(int(u.y * float(np)), np - 1) * nz + std::min(int(u.x * float(nz)), nz - 1);
    }
};

/// Returns a cone around the directions of the samples.
ConeBins coneAround(const std::vector<LightSample>& samples) {
    V3f mean(0);
    for (const LightSample& s : samples)
        mean += s.wi;
    const V3f axis = length(mean) > .2f * float(samples.size()) ? normalize(mean) : V3f(0, 0, 1);
    float maxOneMinusCos = 1e-30f;
    for (const LightSample& s : samples)
        maxOneMinusCos =
            std::max(maxOneMinusCos,
                     dot(s.wi, axis) > .7f ? oneMinusCos(length2(cross(s.wi, axis))) : 1 - dot(s.wi, axis));
    return {Frame::fromNormal(axis), std::min(maxOneMinusCos * 1.05f, 2.f)};
}

std::vector<LightSample> sampleLight(const Light& light, const Case& c, int n) {
    std::vector<V2f> u(n);
    for (int i = 0; i < n; ++i)
        u[i] = random2D(3, i);
    std::vector<LightSample> out(n);
    light.sample(c.p, c.time, u.data(), n, out.data());
    return out;
}

} // namespace

TEST(AreaLights, SampleAgreesWithPdfAndEmission) {
    for (const Case& c : cases()) {
        const auto light = makeLight(c.shape, c.twoSided);
        int nonBlack = 0, missed = 0;
        for (const LightSample& s : sampleLight(*light, c, 4000)) {
            ASSERT_NEAR(length(s.wi), 1, 1e-5) << c.name;
            const LightHit* nearest = nullptr;
            const auto hits = allHits(c.shape, c.p, s.wi, c.time);
            for (const LightHit& h : hits)
                if (!nearest || std::abs(h.distance - s.distance) < std::abs(nearest->distance - s.distance))
                    nearest = &h;
            if (!nearest || std::abs(nearest->distance - s.distance) > 2e-3f * s.distance) {
                ++missed; // rounding at an edge
                continue;
            }
            const float pdf = light->pdf(c.p, c.time, s.wi, nearest);
            if (absDot(nearest->ng, s.wi) > .02f && absDot(nearest->ng, s.wi) * c.p.length() > 1e-6f) {
                ASSERT_NEAR(pdf / s.pdf, 1, 4e-3) << c.name;
                const Rgb radiance = light->emitted(nearest->ng, -s.wi);
                ASSERT_EQ(radiance, s.radiance) << c.name;
            }
            if (!isBlack(s.radiance)) {
                ++nonBlack;
                ASSERT_GT(s.pdf, 0) << c.name;
                ASSERT_TRUE(light->mayIntersect(c.p, c.time, s.wi)) << c.name;
            }
        }
        EXPECT_GT(nonBlack, 900) << c.name;
        EXPECT_LT(missed, 30) << c.name;
    }
}

TEST(AreaLights, SoAMethodsEqualScalarMethods) {
    for (const Case& c : cases()) {
        const auto light = makeLight(c.shape, c.twoSided);
        constexpr int kPoints = 20, kSamples = 3 * kPoints;
        V3SoA p, bySample;
        V2SoA u;
        float time[kSoAWidth], timeBySample[kSoAWidth], solidAngle[kSoAWidth];
        int32_t point[kSoAWidth];
        for (int i = 0; i < kPoints; ++i) { // the first point is illuminated
            const V2f a = random2D(4, i), b = random2D(5, i);
            p.set(i, c.p + V3f(a.x - .5f, a.y - .5f, b.x - .5f) * (.2f * float(i)));
            time[i] = i == 0 ? c.time : b.y;
        }
        for (int i = 0; i < kSamples; ++i) {
            point[i] = i / 3;
            u.set(i, random2D(6, i));
            bySample.set(i, p.at(i / 3));
            timeBySample[i] = time[i / 3];
        }
        LightSampleSoA samples;
        light->sampleSoA({bySample, timeBySample, point, u, kSamples}, samples);
        light->solidAngleSoA(p, time, kPoints, solidAngle);
        for (int i = 0; i < kSamples; ++i) {
            const V2f ui = u.at(i);
            LightSample s;
            light->sample(p.at(point[i]), time[point[i]], &ui, 1, &s);
            ASSERT_EQ(s.radiance, samples.radiance.at(i)) << c.name;
            ASSERT_EQ(s.wi, samples.wi.at(i)) << c.name;
            ASSERT_EQ(s.distance, samples.distance[i]) << c.name;
            ASSERT_EQ(s.pdf, samples.pdf[i]) << c.name;
        }
        for (int i = 0; i < kPoints; ++i)
            EXPECT_EQ(solidAngle[i], light->solidAngle(p.at(i), time[i])) << c.name;
    }
}

TEST(AreaLights, ChiSquareOfDirections) {
    constexpr int nz = 10, np = 10;
    for (const Case& c : cases()) {
        // The density of area sampling is infinite, but integrable, at the silhouette of an ellipsoid, so the
        // expected counts need a finer quadrature and allow fewer samples.
        const bool singular = c.name.starts_with("ellipsoid");
        const int n = singular ? 8000 : 60000, sub = singular ? 80 : 24;
        const auto light = makeLight(c.shape, c.twoSided);
        const auto samples = sampleLight(*light, c, n);
        const ConeBins cone = coneAround(samples);
        std::vector<double> counts(nz * np), expected(nz * np);
        for (const LightSample& s : samples)
            counts[cone.bin(s.wi, nz, np)] += 1;
        const double solidAngle = 2 * M_PI * cone.oneMinusCosMax;
        double total = 0;
        for (int b = 0; b < nz * np; ++b) {
            for (int k = 0; k < sub * sub; ++k) {
                const V2f u((float(b % nz) + (float(k % sub) + .5f) / float(sub)) / nz,
                            (float(b / nz) + (float(k / sub) + .5f) / float(sub)) / np);
                const V3f w = cone.frame.toWorld(uniformCone(u, cone.oneMinusCosMax));
                const auto hits = allHits(c.shape, c.p, w, c.time);
                // Spheres are sampled by direction; for area sampling the densities of all hits add up.
                const bool byCone = c.name.starts_with("sphere");
                for (size_t h = 0; h < (byCone ? std::min<size_t>(hits.size(), 1) : hits.size()); ++h)
                    expected[b] +=
                        light->pdf(c.p, c.time, w, &hits[h]) * solidAngle / (nz * np * sub * sub) * n;
            }
            total += expected[b];
        }
        EXPECT_NEAR(total / n, 1, .02) << c.name << ": the density does not integrate to 1";
        EXPECT_GT(chiSquareP(counts, expected), 1e-4) << c.name;
    }
}

TEST(AreaLights, MayIntersectAndSolidAngleAreConservative) {
    // For directions within the cone and over the sphere: if a hit emits light, mayIntersect is true, and
    // these directions fill at most solidAngle.
    constexpr int n = 20000;
    for (const Case& c : cases()) {
        const auto light = makeLight(c.shape, c.twoSided);
        const auto samples = sampleLight(*light, c, n);
        const ConeBins cone = coneAround(samples);
        int emittingCount = 0;
        for (int i = 0; i < 2 * n; ++i) {
            const bool isInCone = i < n;
            const V3f w = isInCone ? cone.frame.toWorld(uniformCone(random2D(9, i), cone.oneMinusCosMax))
                                   : uniformSphere(random2D(9, i));
            bool emits = false;
            for (const LightHit& h : allHits(c.shape, c.p, w, c.time))
                emits |= !isBlack(light->emitted(h.ng, -w));
            emittingCount += isInCone && emits;
            if (emits) {
                ASSERT_TRUE(light->mayIntersect(c.p, c.time, w)) << c.name;
            }
        }
        const double solidAngle = emittingCount * 2 * M_PI * cone.oneMinusCosMax / n;
        EXPECT_GE(light->solidAngle(c.p, c.time), solidAngle * (1 - 3 / std::sqrt(emittingCount + 1.)))
            << c.name;
        EXPECT_LE(light->solidAngle(c.p, c.time), 4 * kPi * 1.00001f) << c.name;
    }
}

TEST(AreaLights, SidesThatDoNotEmitAreNotSampled) {
    struct Dark {
        std::string name;
        PlacedShape shape;
        V3f p;
    };
    const V3f front(0, 0, 5), behind(0, 0, -5);
    const Dark dark[] = {
        {"disk", placed(std::make_shared<TestDisk>(1.f)), behind},
        {"disk, reversed", placed(std::make_shared<TestDisk>(1.f), {}, nullptr, true), front},
        {"disk, mirrored", placed(std::make_shared<TestDisk>(1.f), scale({1, 1, -1})), front},
        {"square", placed(squareMesh()), behind},
        {"square, reversed", placed(squareMesh(), {}, nullptr, true), front},
        {"sphere, inside", placed(std::make_shared<TestSphere>(8.f)), front},
        {"sphere, reversed, outside", placed(std::make_shared<TestSphere>(1.f), {}, nullptr, true), front},
    };
    for (const Dark& d : dark) {
        const auto light = makeLight(d.shape), both = makeLight(d.shape, true);
        for (int i = 0; i < 100; ++i) {
            const V3f w = normalize(-d.p + uniformSphere(random2D(1, i)) * .5f);
            EXPECT_FALSE(light->mayIntersect(d.p, 0, w)) << d.name;
            EXPECT_TRUE(both->mayIntersect(d.p, 0, w)) << d.name;
            LightSample s;
            const V2f u = random2D(2, i);
            light->sample(d.p, 0, &u, 1, &s);
            EXPECT_TRUE(isBlack(s.radiance)) << d.name;
            both->sample(d.p, 0, &u, 1, &s);
            EXPECT_FALSE(isBlack(s.radiance)) << d.name;
        }
        EXPECT_EQ(light->solidAngle(d.p, 0), 0) << d.name;
        EXPECT_GT(both->solidAngle(d.p, 0), 0) << d.name;
    }
}

TEST(AreaLights, MayIntersectIsExactForFlatLights) {
    const auto disk = makeLight(placed(std::make_shared<TestDisk>(1.f, .5f)), true);
    const auto square = makeLight(placed(squareMesh()), true);
    const V3f p(0, 0, 4);
    const auto towards = [&](const V3f& q) { return normalize(q - p); };
    EXPECT_TRUE(disk->mayIntersect(p, 0, towards({.8f, 0, .5f})));
    EXPECT_FALSE(disk->mayIntersect(p, 0, towards({1.01f, 0, .5f})));
    EXPECT_FALSE(disk->mayIntersect(p, 0, towards({.3f, 0, .5f}))) << "through the hole";
    EXPECT_FALSE(disk->mayIntersect(p, 0, -towards({.8f, 0, .5f})));
    EXPECT_TRUE(square->mayIntersect(p, 0, towards({.99f, .99f, 0})));
    EXPECT_FALSE(square->mayIntersect(p, 0, towards({1.45f, 0, 0})));
    // Close to the plane, where the bounding sphere is hit.
    EXPECT_FALSE(square->mayIntersect({5, 0, .2f}, 0, normalize(V3f(-5, 0, .3f))));
}

namespace {

/// Estimates the irradiance at p with normal n from light samples.
Rgb irradiance(const Light& light, const V3f& p, const V3f& n, float time = 0, int count = 1 << 16) {
    std::vector<V2f> u(count);
    for (int i = 0; i < count; ++i) {
        const double golden = (i + .5) * 0.61803398874989485;
        u[i] = {(float(i) + .5f) / float(count), float(golden - std::floor(golden))};
    }
    std::vector<LightSample> samples(count);
    light.sample(p, time, u.data(), count, samples.data());
    double sum[3] = {0, 0, 0};
    for (const LightSample& s : samples)
        for (int k = 0; k < 3 && s.pdf > 0; ++k)
            sum[k] += s.radiance[k] * std::max(0.f, dot(s.wi, n)) / s.pdf / count;
    return {float(sum[0]), float(sum[1]), float(sum[2])};
}

} // namespace

TEST(AreaLights, SphereIrradianceEqualsClosedForm) {
    for (const float distance : {1.6f, 3.f, 100.f, 1e5f}) {
        const auto light = makeLight(placed(std::make_shared<TestSphere>(1.5f), translate({0, 0, distance})));
        const double exact = M_PI * sqr(1.5f / distance); // times radiance
        const Rgb e = irradiance(*light, V3f(0), {0, 0, 1});
        EXPECT_NEAR(e.x / (3 * exact), 1, 1e-4) << distance;
        EXPECT_NEAR(e.y / (2 * exact), 1, 1e-4) << distance;
        EXPECT_NEAR(e.z / exact, 1, 1e-4) << distance;
    }
    // Inside a closed light the irradiance is π L everywhere.
    const auto closed = makeLight(placed(std::make_shared<TestSphere>(1.5f), {}, nullptr, true));
    EXPECT_NEAR(irradiance(*closed, {.7f, .3f, 1}, {0, 1, 0}).z, M_PI, 1e-3);
    const auto ellipsoid =
        makeLight(placed(std::make_shared<TestSphere>(1.5f), scale({1, 2, 1}), nullptr, true));
    EXPECT_NEAR(irradiance(*ellipsoid, {.3f, .3f, .2f}, {0, 1, 0}).z, M_PI, 3e-3);
}

TEST(AreaLights, DiskIrradianceEqualsClosedForm) {
    for (const float height : {.2f, 1.f, 50.f}) {
        const auto light =
            makeLight(placed(std::make_shared<TestDisk>(1.f),
                             translate({0, 0, -.5f}) * rotate({1, 0, 0}, 180) * translate({0, 0, height})));
        EXPECT_NEAR(irradiance(*light, V3f(0), {0, 0, 1}).z / (M_PI / (1 + sqr(height))), 1, 2e-3) << height;
    }
}

TEST(AreaLights, SquareIrradianceEqualsClosedForm) {
    // Lambert's polygon formula: E = L/2 Σ Θ_i dot(Γ_i, n).
    const M44f m = scale({2, .7f, 1}) * rotate({1, .2f, 0}, 165) * translate({.3f, .2f, 1.5f});
    const V3f n(0, 0, 1);
    double exact = 0;
    const V3f corners[4] = {{-1, -1, 0}, {-1, 1, 0}, {1, 1, 0}, {1, -1, 0}};
    for (int i = 0; i < 4; ++i) {
        const V3f a = normalize(transformPoint(m, corners[i]));
        const V3f b = normalize(transformPoint(m, corners[(i + 1) % 4]));
        exact += .5 * std::acos(dot(a, b)) * dot(normalize(cross(a, b)), n);
    }
    exact = std::abs(exact);
    ASSERT_GT(exact, .1);
    const Rgb e = irradiance(*makeLight(placed(squareMesh(), m)), V3f(0), n);
    EXPECT_NEAR(e.z / exact, 1, 1e-3);
    // The same light with its transform baked in, and as the end of a motion.
    TriangleMesh baked = squareMesh();
    for (V3f& v : baked.positions[0])
        v = transformPoint(m, v);
    EXPECT_NEAR(irradiance(*makeLight(placed(baked)), V3f(0), n).z / exact, 1, 1e-3);
    const auto moving = placed(squareMesh(), m, motion({translate({9, 0, 0}), M44f()}));
    EXPECT_NEAR(irradiance(*makeLight(moving), V3f(0), n, 1).z / exact, 1, 1e-3);
}

TEST(AreaLights, PowerIsAreaTimesPi) {
    const auto square = makeLight(placed(squareMesh(), scale({2, 3, 1})));
    EXPECT_NEAR(square->power(1).z, M_PI * 24, 1e-3);
    const auto both = makeLight(placed(squareMesh()), true);
    EXPECT_NEAR(both->power(1).z, 2 * M_PI * 4, 1e-4);
    const auto sphere = makeLight(placed(std::make_shared<TestSphere>(1.f), scale(V3f(2))));
    EXPECT_NEAR(sphere->power(1).z, M_PI * 4 * M_PI * 4, 1e-3);
    const auto disk = makeLight(placed(std::make_shared<TestDisk>(1.f), scale({2, 3, 1})));
    EXPECT_NEAR(disk->power(1).z, M_PI * M_PI * 6, 1e-3);
    // Ellipsoid 1:1:2, prolate: 2π (1 + 2 asin(e)/e), e = sqrt(3)/2.
    const double e = std::sqrt(3.) / 2;
    const auto ellipsoid = makeLight(placed(std::make_shared<TestSphere>(1.f), scale({1, 1, 2})));
    EXPECT_NEAR(ellipsoid->power(1).z / (M_PI * 2 * M_PI * (1 + 2 * std::asin(e) / e)), 1, 1e-2);
}

TEST(AreaLights, PowerIsPositiveIfOnlyASmallPartOfTheTextureIsBright) {
    struct Spot : Texture {
        Rgb rgb(const TextureQuery& q) const override { return Rgb(q.uv.x > .999f && q.uv.y > .999f); }
    };
    TriangleMesh mesh = squareMesh();
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    Emission emission;
    emission.radiance = Rgb(1);
    emission.texture = std::make_shared<Spot>();
    EXPECT_GT(makeMeshLight(placed(mesh), emission)->power(1).y, 0);
}

TEST(AreaLights, ErrorsHaveLocations) {
    static Diagnostics quiet;
    const BuildContext context{.diagnostics = quiet};
    const auto make = [&](const ParamSet& params, const PlacedShape& shape) {
        return diffuseAreaLightPlugin().create(params, context, AreaLightArgs{shape});
    };
    const PlacedShape square = placed(squareMesh());
    EXPECT_EQ(errorOffset([&] { make(Params().rgb("L", 1, -1, 1), square); }), 10);
    EXPECT_EQ(errorOffset([&] { make(Params().rgb("L", 1, 1, 1).ints("nsamples", {0}), square); }), 20);
    try {
        make(Params(), placed(squareMesh(), scale({1, 0, 1})));
        FAIL() << "no error for a light of zero area";
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), "area light on a shape of zero area");
        EXPECT_TRUE(e.location);
        EXPECT_EQ(e.location.offset, 0u);
    }
    EXPECT_THROW(make(Params(), placed(std::make_shared<TestDisk>(1.f), scale({1, 0, 1}))), Error);
    EXPECT_THROW(make(Params(), placed(TriangleMesh{{}, {{}}, {}, {}, {}, {}, {1}})), Error);
    EXPECT_EQ(make(Params().ints("samples", {7}), square)->sampleCount, 7);
    EXPECT_EQ(make(Params().rgb("L", 1, 2, 3).floats("scale", {2}), square)->emitted({0, 0, 1}, {0, 0, 1}),
              Rgb(2, 4, 6));
    EXPECT_EQ(make(Params().rgb("scale", 2, 1, 0), square)->emitted({0, 0, 1}, {0, 0, 1}), Rgb(2, 1, 0));
}
