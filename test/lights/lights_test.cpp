// Tests of the lights without a shape: point, spot, distant and infinite.
#include "core/scene/scene.h"
#include "light_scene.h"
#include "lights/distant.h"
#include "lights/environment_map.h"
#include "lights/infinite.h"
#include "lights/point.h"
#include "lights/spot.h"
#include "support/chi_square.h"
#include "support/params.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <unistd.h>

using namespace strobe;
using namespace strobe::test;

namespace {

using LightPlugin = Plugin<std::shared_ptr<Light>, const LightArgs&>;

std::shared_ptr<Light> make(const LightPlugin& plugin, const ParamSet& params,
                            const KeyedTransform& toWorld = {}, Conventions conventions = Conventions::PbrtV4,
                            Shutter shutter = {0, 1}) {
    static Diagnostics quiet;
    return plugin.create(params, BuildContext{.diagnostics = quiet, .conventions = conventions},
                         LightArgs{toWorld, shutter});
}

/// Returns the sample for u = (.5, .5).
LightSample sampleOnce(const Light& light, const V3f& p, float time = 0) {
    LightSample s;
    const V2f u(.5f, .5f);
    light.sample(p, time, &u, 1, &s);
    return s;
}

KeyedTransform sliding() {
    return KeyedTransform({0, 1}, {translate({0, 0, 0}), translate({4, 0, 0})},
                          MotionConvention::ObjectToWorld);
}

/// Returns a dark sky with a few very bright pixels, some of them at the seam and at a pole.
Image contrastImage(int width = 32, int height = 16) {
    Image image{width, height, std::vector<Rgb>(size_t(width * height))};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.at(x, y) = x > width / 2 ? Rgb(.01f, .02f, .01f) * float(1 + (x * 7 + y * 3) % 5) : Rgb(0);
    image.at(5, height * 6 / 16) = Rgb(1000, 500, 100);
    image.at(0, height * 9 / 16) = Rgb(300);
    image.at(width - 1, 3) = Rgb(0, 0, 200);
    image.at(9, 0) = Rgb(50, 80, 50);
    return image;
}

/// An 8-bit binary PPM file that is removed by the destructor.
class ImageFile {
  public:
    ImageFile(int width, int height, const std::vector<unsigned char>& rgb) {
        m_path = testing::TempDir() + "strobe_lights_" + std::to_string(getpid()) + ".ppm";
        std::ofstream out(m_path, std::ios::binary);
        out << "P6\n" << width << " " << height << "\n255\n";
        out.write(reinterpret_cast<const char*>(rgb.data()), std::streamsize(rgb.size()));
    }
    ~ImageFile() { std::remove(m_path.c_str()); }
    const std::string& path() const { return m_path; }

  private:
    std::string m_path;
};

} // namespace

TEST(PointLight, RadianceFallsWithTheSquaredDistance) {
    const auto light =
        make(pointLightPlugin(), Params().rgb("I", 8, 4, 0).point("from", {1, 0, 0}).floats("scale", {2}),
             KeyedTransform(rotate({0, 0, 1}, 90) * translate({0, 0, 5})));
    const LightSample s = sampleOnce(*light, {0, 1, 1});
    EXPECT_NEAR(s.distance, 4, 1e-5);
    EXPECT_NEAR(length(s.wi - V3f(0, 0, 1)), 0, 1e-6);
    EXPECT_NEAR(s.radiance.x, 1, 1e-5);
    EXPECT_NEAR(s.radiance.y, .5, 1e-5);
    EXPECT_EQ(s.pdf, 1);
    EXPECT_TRUE(light->isDelta());
    EXPECT_FALSE(light->mayIntersect({0, 0, 0}, 0, {0, 0, 1}));
    EXPECT_EQ(light->solidAngle({0, 0, 0}, 0), 0);
    EXPECT_NEAR(light->power(1).x, 16 * 4 * M_PI, 1e-3);
    const auto plain = make(pointLightPlugin(), Params().point("from", {0, 1, 5}));
    EXPECT_TRUE(isBlack(sampleOnce(*plain, {0, 1, 5}).radiance)) << "p is the position of the light";
}

TEST(PointLight, MovesUnderPbrtV4ConventionsOnly) {
    const auto moving = make(pointLightPlugin(), {}, sliding(), Conventions::PbrtV4, {.5f, 1});
    EXPECT_NEAR(sampleOnce(*moving, {0, 0, 1}, 0).wi.x, 2 / std::sqrt(5.f), 1e-5);
    EXPECT_NEAR(sampleOnce(*moving, {4, 0, 1}, 1).distance, 1, 1e-5);
    const auto still = make(pointLightPlugin(), {}, sliding(), Conventions::PbrtV2, {.5f, 1});
    EXPECT_NEAR(sampleOnce(*still, {0, 0, 1}, 1).distance, 1, 1e-5);
}

TEST(PointAndSpotLights, SampleSoAEqualsSample) {
    const auto test = [](const Light& light) {
        constexpr int n = kSoAWidth - 3;
        V3SoA p;
        V2SoA u;
        float time[kSoAWidth];
        int32_t point[kSoAWidth];
        for (int i = 0; i < n; ++i) { // each point twice; the first is the position of the light
            const V2f a = random2D(1, i / 2), b = random2D(2, i / 2);
            point[i] = i / 2;
            time[i] = b.y;
            p.set(i, i < 2 ? V3f(1, 0, 0) : V3f(a.x, a.y, b.x) * 3.f);
        }
        LightSampleSoA samples;
        light.sampleSoA({p, time, point, u, n}, samples);
        for (int i = 0; i < n; ++i) {
            const LightSample s = sampleOnce(light, p.at(i), time[i]);
            EXPECT_EQ(samples.wi.at(i), s.wi);
            EXPECT_EQ(samples.radiance.at(i), s.radiance);
            EXPECT_EQ(samples.pdf[i], 1);
            EXPECT_EQ(samples.distance[i], s.distance);
        }
    };
    const Params params = Params().rgb("I", 8, 4, 1).point("from", {1, 0, 0});
    test(*make(pointLightPlugin(), params));
    test(*make(pointLightPlugin(), params, sliding()));
    for (const char* falloff : {"quartic", "smoothstep", "squared"}) {
        const Params cone = Params(params)
                                .string("falloff", falloff)
                                .floats("coneangle", {50})
                                .floats("conedeltaangle", {40});
        test(*make(spotLightPlugin(), cone));
        test(*make(spotLightPlugin(), cone, sliding()));
    }
    test(*make(spotLightPlugin(), Params(params).floats("conedeltaangle", {0})));
}

TEST(SpotLight, FalloffIsAPolynomialOfTheCosine) {
    const Params params = Params()
                              .rgb("I", 1, 1, 1)
                              .point("from", {0, 0, 2})
                              .point("to", {0, 0, 0})
                              .floats("coneangle", {30})
                              .floats("conedeltaangle", {10});
    for (const auto conventions : {Conventions::PbrtV2, Conventions::PbrtV4}) {
        const auto light =
            make(spotLightPlugin(), params, KeyedTransform(rotate({1, 0, 0}, 180)), conventions);
        const auto radianceAt = [&](float degrees) { // the light is at z = -2 and emits along +z
            return sampleOnce(*light,
                              V3f(std::sin(radians(degrees)), 0, std::cos(radians(degrees))) + V3f(0, 0, -2))
                .radiance.x;
        };
        EXPECT_NEAR(radianceAt(0), 1, 1e-5);
        EXPECT_NEAR(radianceAt(19.9f), 1, 1e-5);
        EXPECT_EQ(radianceAt(30.1f), 0);
        EXPECT_EQ(radianceAt(180), 0);
        const float x =
            (std::cos(radians(25)) - std::cos(radians(30))) / (std::cos(radians(20)) - std::cos(radians(30)));
        EXPECT_NEAR(radianceAt(25), conventions == Conventions::PbrtV2 ? x * x * x * x : x * x * (3 - 2 * x),
                    1e-4);
    }
    EXPECT_EQ(errorOffset([] { make(spotLightPlugin(), Params().point("to", V3f(0))); }), 10);
    EXPECT_EQ(errorOffset([] { make(spotLightPlugin(), Params().floats("coneangle", {-5})); }), 10);
}

TEST(LightSampler, FrequenciesEqualProbabilities) {
    constexpr int kNumbers = 1 << 24; // all values of unitFloat
    const std::vector<std::vector<float>> cases{
        {1, 0, 3, 0}, {0, 1e-30f, 1e30f, 0}, std::vector<float>(100000, .37f)};
    for (const std::vector<float>& powers : cases) {
        const LightSampler picker(powers);
        std::vector<int> count(powers.size());
        for (int i = 0; i < kNumbers; ++i)
            ++count[size_t(picker.pick(float(i) / kNumbers))];
        for (size_t i = 0; i < powers.size(); ++i) {
            EXPECT_EQ(count[i] > 0, powers[i] > 0) << i;
            EXPECT_NEAR(picker.probability(int(i)) * kNumbers, count[i], 1) << i;
        }
    }
    EXPECT_NEAR(LightSampler({1, 0, 3}).probability(0), .25f, 1e-6f);
    EXPECT_EQ(LightSampler({0, 0}).probability(1), .5f);
}

TEST(SpotLight, PowerOfNarrowConesIsAccurate) {
    for (const float degrees : {1.f, .1f, .01f, .001f}) {
        const Params cone = Params().floats("coneangle", {degrees}).floats("conedeltaangle", {0});
        const double solidAngle = 2 * M_PI * 2 * std::pow(std::sin(radians(degrees) / 2.), 2);
        EXPECT_NEAR(make(spotLightPlugin(), cone)->power(1).x / solidAngle, 1, 1e-4) << degrees;
        const auto withPower = make(spotLightPlugin(), Params(cone).floats("power", {5}));
        EXPECT_NEAR(withPower->power(1).x / 5, 1, 1e-4) << degrees;
        const float sine = std::sin(radians(degrees * .9f));
        EXPECT_GT(sampleOnce(*withPower, V3f(sine, 0, 1)).radiance.x, 0) << degrees;
    }
}

TEST(DistantLight, DiskHasTheIrradianceOfThePoint) {
    const auto light =
        make(distantLightPlugin(),
             Params().rgb("L", 3, 2, 1).point("from", {0, 5, 0}).point("to", V3f(0)).floats("angle", {40}));
    Rgb sum(0);
    constexpr int kEdge = 64;
    for (int i = 0; i < kEdge * kEdge; ++i) {
        const V2f u((float(i % kEdge) + .5f) / kEdge, (float(i / kEdge) + .5f) / kEdge);
        LightSample s;
        light->sample(V3f(7, 8, 9), 0, &u, 1, &s);
        EXPECT_GE(s.wi.y, std::cos(radians(20.f)) - 1e-5f);
        EXPECT_EQ(s.distance, kInfinity);
        sum += s.radiance * (s.wi.y / s.pdf / (kEdge * kEdge));
    }
    EXPECT_NEAR(sum.x, 3, 1e-3);
    EXPECT_NEAR(sum.z, 1, 1e-3);
    EXPECT_FALSE(light->isDelta());
    EXPECT_THROW(make(distantLightPlugin(), Params().floats("angle", {180})), Error);
}

TEST(DistantLight, IrradianceIsConstantFromInfinity) {
    const auto light =
        make(distantLightPlugin(), Params().rgb("L", 3, 2, 1).point("from", {0, 5, 0}).point("to", V3f(0)),
             KeyedTransform(rotate({0, 0, 1}, -90) * translate({9, 9, 9})));
    const LightSample s = sampleOnce(*light, {1, 2, 3});
    EXPECT_NEAR(length(s.wi - V3f(1, 0, 0)), 0, 1e-6);
    EXPECT_EQ(s.distance, kInfinity);
    EXPECT_EQ(s.radiance, Rgb(3, 2, 1));
    EXPECT_NEAR(light->power(2).z, M_PI * 4, 1e-4);
    EXPECT_EQ(errorOffset([] { make(distantLightPlugin(), Params().point("to", V3f(0))); }), 10);
}

TEST(EnvironmentMap, HasTheOrientationOfPbrtV2) {
    // u = φ/2π from +x to +y, v = θ/π from +z.
    Image image{8, 4, std::vector<Rgb>(32)};
    for (int i = 0; i < 32; ++i)
        image.pixels[size_t(i)] = Rgb(float(i % 8), float(i / 8), 0);
    const EnvironmentMap map(image);
    const auto center = [](int x, int y) {
        const float phi = (float(x) + .5f) / 8 * 2 * kPi, theta = (float(y) + .5f) / 4 * kPi;
        return V3f(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    };
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x) {
            const Rgb c = map.radiance(center(x, y));
            EXPECT_NEAR(c.x, x, 1e-4);
            EXPECT_NEAR(c.y, y, 1e-4);
        }
    EXPECT_NEAR(map.radiance({0, 0, 1}).y, 0, 1e-5);
    EXPECT_NEAR(map.radiance({0, 0, -1}).y, 3, 1e-5);
    EXPECT_NEAR(map.radiance({1, 0, 0}).x, 3.5, 1e-4) << "at the seam, between columns 7 and 0";
    EXPECT_NEAR(map.radiance({0, 1, 0}).x, 1.5, 1e-4);
}

TEST(EnvironmentMap, SampleAgreesWithPdfAndRadiance) {
    const EnvironmentMap map(contrastImage());
    for (int i = 0; i < 20000; ++i) {
        const EnvironmentMap::Sample s = map.sample(random2D(31, i));
        ASSERT_NEAR(length(s.w), 1, 1e-5);
        ASSERT_GT(s.pdf, 0);
        const float pdf = map.pdf(s.w);
        EXPECT_NEAR(pdf / s.pdf, 1, 5e-3) << s.w;
        EXPECT_NEAR(luminance(map.radiance(s.w)), luminance(s.radiance),
                    2e-3f * luminance(s.radiance) + 2e-3f);
    }
}

TEST(EnvironmentMap, PdfIsPositiveForNonBlackRadianceAndIntegratesToOne) {
    const EnvironmentMap map(contrastImage());
    constexpr int nx = 1024, ny = 512;
    double integral = 0;
    for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x) {
            const double theta = (y + .5) / ny * M_PI, phi = (x + .5) / nx * 2 * M_PI;
            const V3f w(float(std::sin(theta) * std::cos(phi)), float(std::sin(theta) * std::sin(phi)),
                        float(std::cos(theta)));
            const float pdf = map.pdf(w);
            if (!isBlack(map.radiance(w))) {
                ASSERT_GT(pdf, 0) << w;
            }
            integral += pdf * std::sin(theta) * M_PI / ny * 2 * M_PI / nx;
        }
    EXPECT_NEAR(integral, 1, 1e-3);
}

TEST(EnvironmentMap, EstimatesTheIntegralOfAHighContrastImage) {
    const EnvironmentMap map(contrastImage());
    // The reference is the sum over a fine grid.
    constexpr int nx = 2048, ny = 1024;
    double sum[3] = {0, 0, 0}, estimate[3] = {0, 0, 0};
    for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x) {
            const double theta = (y + .5) / ny * M_PI, phi = (x + .5) / nx * 2 * M_PI;
            const Rgb c = map.radiance(V3f(float(std::sin(theta) * std::cos(phi)),
                                           float(std::sin(theta) * std::sin(phi)), float(std::cos(theta))));
            for (int k = 0; k < 3; ++k)
                sum[k] += c[k] * std::sin(theta) * M_PI / ny * 2 * M_PI / nx;
        }
    constexpr int n = 40000;
    double maxWeight = 0;
    for (int i = 0; i < n; ++i) {
        const EnvironmentMap::Sample s = map.sample(random2D(37, i));
        for (int k = 0; k < 3; ++k)
            estimate[k] += s.radiance[k] / s.pdf / n;
        maxWeight = std::max(maxWeight, double(luminance(s.radiance) / s.pdf));
    }
    const double exact = .212671 * sum[0] + .715160 * sum[1] + .072169 * sum[2];
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(map.mean()[k] * 4 * M_PI / sum[k], 1, 1e-2) << k; // approximate
        EXPECT_NEAR(estimate[k] / sum[k], 1, .03) << k;
    }
    // Luminance / pdf is constant up to the variation of sinθ within a row of cells.
    EXPECT_LT(maxWeight, 2.5 * exact);
}

TEST(EnvironmentMap, ChiSquare) {
    const EnvironmentMap map(contrastImage(16, 8));
    constexpr int n = 100000, nx = 32, ny = 16, sub = 16;
    std::vector<double> counts(nx * ny), expected(nx * ny);
    for (int i = 0; i < n; ++i) {
        const V3f w = map.sample(random2D(41, i)).w;
        const float phi = std::atan2(w.y, w.x), u = (phi < 0 ? phi + 2 * kPi : phi) / (2 * kPi);
        const float v = std::acos(std::clamp(w.z, -1.f, 1.f)) / kPi;
        counts[std::min(int(v * ny), ny - 1) * nx + std::min(int(u * nx), nx - 1)] += 1;
    }
    for (int b = 0; b < nx * ny; ++b)
        for (int k = 0; k < sub * sub; ++k) {
            const double phi = (b % nx + (k % sub + .5) / sub) / nx * 2 * M_PI;
            const double theta = (b / nx + (k / sub + .5) / sub) / ny * M_PI;
            const V3f w(float(std::sin(theta) * std::cos(phi)), float(std::sin(theta) * std::sin(phi)),
                        float(std::cos(theta)));
            expected[b] += n * map.pdf(w) * std::sin(theta) * 2 * M_PI * M_PI / (nx * ny * sub * sub);
        }
    EXPECT_GT(chiSquareP(counts, expected), 1e-4);
}

TEST(EnvironmentMap, BlackAndOnePixelMapsAreValid) {
    const EnvironmentMap black(Image{4, 2, std::vector<Rgb>(8, Rgb(0))}), tiny(Image{1, 1, {Rgb(2)}});
    for (int i = 0; i < 100; ++i) {
        const auto b = black.sample(random2D(1, i)), t = tiny.sample(random2D(1, i));
        EXPECT_TRUE(isBlack(b.radiance) && std::isfinite(b.pdf) && length(b.w) > .9f);
        EXPECT_NEAR(t.radiance.x, 2, 1e-6);
        EXPECT_NEAR(tiny.pdf(t.w) / t.pdf, 1, 1e-3);
    }
    EXPECT_NEAR(tiny.mean().x, 2, 1e-5);
}

TEST(InfiniteLight, ConstantRadianceIsSampledUniformly) {
    const auto light = make(infiniteLightPlugin(), Params().rgb("L", 1, 2, 3).ints("nsamples", {4}));
    EXPECT_EQ(light->sampleCount, 4);
    EXPECT_TRUE(light->isEnvironment());
    const LightSample s = sampleOnce(*light, V3f(0));
    EXPECT_EQ(s.radiance, Rgb(1, 2, 3));
    EXPECT_NEAR(s.pdf, 1 / (4 * M_PI), 1e-7);
    EXPECT_EQ(light->pdf(V3f(0), 0, s.wi, nullptr), s.pdf);
    EXPECT_EQ(light->environment({1, 0, 0}), Rgb(1, 2, 3));
    EXPECT_NEAR(light->power(1).x, 4 * M_PI * M_PI, 1e-4);
}

TEST(InfiniteLight, SoAMethodsEqualScalarMethods) {
    std::vector<unsigned char> rgb;
    for (int i = 0; i < 16 * 8 * 3; ++i)
        rgb.push_back(static_cast<unsigned char>(i * 37 % 256));
    const ImageFile file(16, 8, rgb);
    for (const M44f& m : {M44f(), rotate({1, 2, 3}, 70), scale({1, 3, .5f})})
        for (const bool hasMap : {false, true}) {
            Params params = Params().rgb("L", 2, 1, .5f);
            const auto light =
                make(infiniteLightPlugin(), hasMap ? params.string("mapname", file.path()) : params,
                     KeyedTransform(m));
            constexpr int n = kSoAWidth - 3;
            V3SoA p, d;
            V2SoA u;
            float time[kSoAWidth] = {}, pdf[kSoAWidth];
            int32_t point[kSoAWidth];
            for (int i = 0; i < n; ++i) {
                p.set(i, V3f(0));
                u.set(i, random2D(8, i));
                point[i] = i;
                d.set(i, uniformSphere(random2D(9, i)));
            }
            for (int axis = 0; axis < 6; ++axis) { // seams and poles
                V3f w(0);
                w[axis / 2] = axis % 2 ? -1.f : 1.f;
                d.set(axis, w);
            }
            LightSampleSoA samples;
            RgbSoA radiance, withoutPdf;
            light->sampleSoA({p, time, point, u, n}, samples);
            light->environmentSoA(d, n, radiance, pdf);
            light->environmentSoA(d, n, withoutPdf, nullptr);
            for (int i = 0; i < n; ++i) {
                const V2f ui = u.at(i);
                LightSample s;
                light->sample(V3f(0), 0, &ui, 1, &s);
                EXPECT_EQ(samples.wi.at(i), s.wi);
                EXPECT_EQ(samples.radiance.at(i), s.radiance);
                EXPECT_EQ(samples.pdf[i], s.pdf);
                EXPECT_EQ(samples.distance[i], s.distance);
                EXPECT_EQ(radiance.at(i), light->environment(d.at(i)));
                EXPECT_EQ(radiance.at(i), withoutPdf.at(i));
                EXPECT_EQ(pdf[i], light->pdf(V3f(0), 0, d.at(i), nullptr));
            }
        }
}

TEST(InfiniteLight, FollowsItsTransform) {
    // 8 x 4 pixels, all black except one at φ = 22.5°, θ = 67.5°.
    std::vector<unsigned char> rgb(8 * 4 * 3, 0);
    std::fill_n(rgb.begin() + 8 * 3, 3, static_cast<unsigned char>(255));
    const ImageFile file(8, 4, rgb);
    const float theta = radians(67.5f), phi = radians(22.5f);
    const V3f bright(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    for (const M44f& m :
         {M44f(), rotate({1, 2, 3}, 70), scale({-1, 1, 1}) * rotate({1, 0, 0}, 30), scale({1, 3, .5f})}) {
        for (const auto conventions : {Conventions::PbrtV2, Conventions::PbrtV4}) {
            const auto light =
                make(infiniteLightPlugin(), Params().string("mapname", file.path()).rgb("L", 2, 2, 2),
                     KeyedTransform(m), conventions);
            const V3f d = normalize(transformVector(m, bright));
            EXPECT_NEAR(light->environment(d).x, 2, 1e-3);
            EXPECT_TRUE(isBlack(light->environment(-d)));
            double reference = 0, estimate = 0, pdfIntegral = 0;
            constexpr int n = 100000;
            for (int i = 0; i < n; ++i) {
                const double golden = (i + .5) * 0.61803398874989485;
                const V2f u((float(i) + .5f) / n, float(golden - std::floor(golden)));
                const V3f w = uniformSphere(u);
                reference += light->environment(w).y * 4 * M_PI / n;
                pdfIntegral += light->pdf(V3f(0), 0, w, nullptr) * 4 * M_PI / n;
                LightSample s;
                light->sample(V3f(0), 0, &u, 1, &s);
                estimate += s.radiance.y / s.pdf / n;
                ASSERT_NEAR(light->pdf(V3f(0), 0, s.wi, nullptr) / s.pdf, 1, 1e-2);
                ASSERT_NEAR(light->environment(s.wi).y, s.radiance.y, 2e-3);
            }
            EXPECT_NEAR(estimate / reference, 1, .01);
            EXPECT_NEAR(pdfIntegral, 1, 5e-3);
            EXPECT_GT(reference, .1);
        }
    }
    EXPECT_EQ(
        errorOffset([] { make(infiniteLightPlugin(), Params().string("mapname", "no-such-file.exr")); }), 10);
}
