// Closed furnaces and white worlds: pictures whose every pixel is known.
#include "core/color/spectrum.h"
#include "core/math/sampling.h"
#include "support/render_text.h"
#include "support/scene_text.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>

namespace strobe {
namespace {

const char* kSamplers[] = {"independent", "stratified", "sobol"};

std::string samplerLine(const std::string& name, int side) {
    const std::string n = std::to_string(side * side), s = std::to_string(side);
    return name == "stratified"
               ? "Sampler \"stratified\" \"integer xsamples\" " + s + " \"integer ysamples\" " + s + "\n"
               : "Sampler \"" + name + "\" \"integer pixelsamples\" " + n + "\n";
}

/// Mean of all pixels and channels over seeds against `truth`.
void expectMean(const BuiltScene& built, double truth, const std::string& what, int seeds = 24) {
    const auto [mean, error] = test::meanOverSeeds(built, seeds);
    EXPECT_NEAR(mean, truth, test::criticalZ(1, seeds) * error + 2e-5 * truth) << what << " error " << error;
}

std::string closedFurnace(const std::string& material, const std::string& sampler,
                          const std::string& strategy) {
    return "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n" + samplerLine(sampler, 4) +
           "Integrator \"path\" \"integer maxdepth\" 200 \"string strategy\" \"" + strategy +
           "\"\nCamera \"perspective\" \"float fov\" 90\nWorldBegin\n"
           "ReverseOrientation\nAreaLightSource \"diffuse\" \"rgb L\" [.5 .5 .5]\nMaterial " +
           material + "\nTranslate .3 .2 0\nShape \"sphere\" \"float radius\" 1\n";
}

struct ClosedCase {
    const char* material;
    double albedo;
};

TEST(ClosedFurnace, EveryPixelIsEmissionOverAbsorption) {
    for (const ClosedCase& c : {ClosedCase{"\"matte\" \"rgb Kd\" [.5 .5 .5]", .5},
                                ClosedCase{"\"matte\" \"rgb Kd\" [.8 .8 .8]", .8},
                                ClosedCase{"\"plastic\" \"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [0 0 0]", .5},
                                ClosedCase{"\"mirror\" \"rgb Kr\" [.5 .5 .5]", .5}})
        for (const char* sampler : kSamplers)
            for (const char* strategy : {"all", "one"}) {
                expectMean(test::build(closedFurnace(c.material, sampler, strategy)), .5 / (1 - c.albedo),
                           std::string(c.material) + ' ' + sampler + ' ' + strategy);
            }
}

/// Files of measurements of a surface that reflects evenly: f = albedo / pi. `albedos`: what that is in RGB.
struct EvenMeasurements {
    explicit EvenMeasurements(double albedo) {
        std::string brdf = "31\n", record;
        std::vector<float> wavelengths, flat(31, 1.f);
        for (int i = 0; i < 31; ++i) {
            wavelengths.push_back(float(400 + 10 * i));
            brdf += std::to_string(400 + 10 * i) + ' ';
            record += ' ' + std::to_string(albedo / M_PI);
        }
        for (double thetaI : {0.0, 0.5, 1.0, 1.5})
            for (double thetaO : {0.0, 0.4, 0.8, 1.2})
                for (double phi : {0.0, 1.0, 2.0, 3.0})
                    brdf += '\n' + std::to_string(thetaI) + " 0 " + std::to_string(thetaO) + ' ' +
                            std::to_string(phi) + record;
        // One cell is all that an even surface needs.
        const int32_t size[3] = {1, 1, 1};
        const double scales[3] = {1 / 1500., 1.15 / 1500., 1.66 / 1500.};
        std::string merl(reinterpret_cast<const char*>(size), sizeof(size));
        for (double scale : scales) {
            const double value = albedo / M_PI / scale;
            merl.append(reinterpret_cast<const char*>(&value), sizeof(value));
        }
        const Rgb white = spectrumToRgb(wavelengths, flat); // not (1, 1, 1): equal energy is not D65
        cases = {{measured(folder.write("even.brdf", brdf)), {}},
                 {measured(folder.write("even.binary", merl)), {}}};
        for (int c = 0; c < 3; ++c)
            cases[0].albedos.push_back(albedo * white[c]), cases[1].albedos.push_back(albedo);
    }
    static std::string measured(const std::filesystem::path& file) {
        return "\"measured\" \"string filename\" \"" + file.string() + '"';
    }
    struct Case {
        std::string material;
        std::vector<double> albedos;
    };
    test::TemporaryFolder folder;
    std::vector<Case> cases;
};

TEST(ClosedFurnace, Measured) {
    const EvenMeasurements measurements(.5);
    for (const auto& c : measurements.cases) {
        double truth = 0;
        for (double albedo : c.albedos)
            truth += .5 / (1 - albedo) / 3;
        for (const char* sampler : kSamplers)
            expectMean(test::build(closedFurnace(c.material, sampler, "all")), truth,
                       c.material + ' ' + sampler);
    }
}

/// The directional albedo of a material for wo at cosine `mu`: an independent quadrature of its own eval;
/// delta lobes are the caller's.
double albedoAt(const Material& material, const Bsdf& bsdf, float mu) {
    const V3f wo(std::sqrt(1 - mu * mu), 0, mu);
    constexpr int kTheta = 512, kPhi = 256;
    double sum = 0;
    for (int i = 0; i < kTheta; ++i)
        for (int j = 0; j < kPhi; ++j) {
            const float z = (float(i) + .5f) / kTheta, phi = 2 * kPi * (float(j) + .5f) / kPhi,
                        r = std::sqrt(1 - z * z);
            const V3f wi(r * std::cos(phi), r * std::sin(phi), z);
            Rgb f;
            float pdf;
            material.evalCos(bsdf, wo, &wi, 1, &f, &pdf);
            sum += (f.x + f.y + f.z) / 3;
        }
    return sum * 2 * kPi / (double(kTheta) * kPhi);
}

/// Average of the albedo over the picture of a sphere of radius 1 that shows the square |x|, |y| < 1/2: at
/// distance r of the axis the cosine is sqrt(1 - r²).
double shownAlbedo(const BuiltScene& built) {
    const SurfacePoint s = built.scene->surface(Hit{kNone, 0, 0, 0.25f, 0.5f, 1}, 0);
    Bsdf bsdf;
    bsdf.material = s.material;
    s.material->prepare({}, bsdf);
    double sum = 0;
    constexpr int kGrid = 24;
    for (int i = 0; i < kGrid; ++i)
        for (int j = i; j < kGrid; ++j) {
            const float x = (float(i) + .5f) / kGrid / 2, y = (float(j) + .5f) / kGrid / 2;
            sum += (i == j ? 1 : 2) * albedoAt(*s.material, bsdf, std::sqrt(1 - x * x - y * y));
        }
    return sum / (kGrid * kGrid);
}

void expectWhiteWorldShows(const std::string& material,
                           const std::function<double(const BuiltScene&)>& albedo) {
    std::optional<double> truth;
    for (const char* sampler : kSamplers)
        for (const char* integrator : {"directlighting", "path"}) {
            const std::string text =
                "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n" +
                samplerLine(sampler, 8) + "Integrator \"" + integrator +
                "\"\nCamera \"orthographic\" \"float screenwindow\" [-.5 .5 -.5 .5]\nWorldBegin\n"
                "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial " +
                material + "\nTranslate 0 0 5\nShape \"sphere\" \"float radius\" 1\n";
            const BuiltScene built = test::build(text);
            if (!truth)
                truth = albedo(built);
            expectMean(built, *truth, material + ' ' + sampler + ' ' + integrator, 16);
        }
}

TEST(WhiteWorld, SphereShowsTheAlbedo) {
    for (const char* material :
         {"\"matte\" \"rgb Kd\" [.7 .7 .7]", "\"matte\" \"rgb Kd\" [.7 .7 .7] \"float sigma\" 30",
          "\"plastic\" \"rgb Kd\" [.3 .3 .3] \"rgb Ks\" [.4 .4 .4] \"float roughness\" .2",
          "\"metal\" \"float roughness\" .1"})
        expectWhiteWorldShows(material, shownAlbedo);
}

TEST(WhiteWorld, MeasuredShowsItsAlbedo) {
    const EvenMeasurements measurements(.7);
    for (const auto& c : measurements.cases)
        expectWhiteWorldShows(
            c.material, [&](const BuiltScene&) { return (c.albedos[0] + c.albedos[1] + c.albedos[2]) / 3; });
}

TEST(WhiteWorld, GlassAndMirrorLoseNothing) {
    for (const char* material : {"\"glass\"", "\"mirror\" \"rgb Kr\" [1 1 1]"})
        for (const char* sampler : kSamplers) {
            const std::string text =
                "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n" +
                samplerLine(sampler, 4) +
                "Integrator \"path\" \"integer maxdepth\" 1000\n"
                "Camera \"orthographic\" \"float screenwindow\" [-1.2 1.2 -1.2 1.2]\nWorldBegin\n"
                "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial " +
                std::string(material) + "\nTranslate 0 0 5\nShape \"sphere\" \"float radius\" 1\n";
            expectMean(test::build(text), 1, std::string(material) + ' ' + sampler);
        }
}

} // namespace
} // namespace strobe
