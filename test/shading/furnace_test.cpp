// Furnace tests: a closed emissive sphere, and objects under a uniform environment. All pixels are known.
#include "core/color/spectrum.h"
#include "core/math/sampling.h"
#include "shading/scene_template.h"
#include "support/render_text.h"
#include "support/scene_text.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>

namespace strobe {
namespace {

const char* kSamplers[] = {"independent", "stratified", "sobol"};

/// Returns a Sampler directive of side² samples per pixel.
std::string samplerLine(const std::string& name, int side) {
    const std::string quoted = '"' + name + '"', s = std::to_string(side);
    if (name == "stratified")
        return "Sampler " + quoted + R"( "integer xsamples" )" + s + R"( "integer ysamples" )" + s;
    return "Sampler " + quoted + R"( "integer pixelsamples" )" + std::to_string(side * side);
}

/// Compares the mean of all pixels, channels and seeds with `expected`.
void expectMean(const BuiltScene& built, double expected, const std::string& label, int seeds = 24) {
    const auto [mean, error] = test::meanOverSeeds(built, seeds);
    EXPECT_NEAR(mean, expected, test::criticalZ(1, seeds) * error + 2e-5 * expected)
        << label << " error " << error;
}

/// Returns the scene of a camera in a sphere that emits radiance 0.5 inwards.
std::string closedFurnace(const std::string& material, const std::string& sampler,
                          const std::string& strategy) {
    const char* scene = R"(
        Film "image" "integer xresolution" 8 "integer yresolution" 8
        $sampler
        Integrator "path" "integer maxdepth" 200 "string strategy" "$strategy"
        Camera "perspective" "float fov" 90
        WorldBegin
        ReverseOrientation
        AreaLightSource "diffuse" "rgb L" [.5 .5 .5]
        Material $material
        Translate .3 .2 0
        Shape "sphere" "float radius" 1
    )";
    return test::substitute(
        scene, {{"$sampler", samplerLine(sampler, 4)}, {"$strategy", strategy}, {"$material", material}});
}

struct ClosedCase {
    const char* material;
    double albedo;
};

TEST(ClosedFurnace, EveryPixelIsEmissionOverAbsorption) {
    for (const ClosedCase& c :
         {ClosedCase{R"("matte" "rgb Kd" [.5 .5 .5])", .5}, ClosedCase{R"("matte" "rgb Kd" [.8 .8 .8])", .8},
          ClosedCase{R"("plastic" "rgb Kd" [.5 .5 .5] "rgb Ks" [0 0 0])", .5},
          ClosedCase{R"("mirror" "rgb Kr" [.5 .5 .5])", .5}})
        for (const char* sampler : kSamplers)
            for (const char* strategy : {"all", "one"}) {
                expectMean(test::build(closedFurnace(c.material, sampler, strategy)), .5 / (1 - c.albedo),
                           std::string(c.material) + ' ' + sampler + ' ' + strategy);
            }
}

/// Returns a file of pbrt's measured BRDF format for the constant BRDF `f`.
std::string constantBrdfFile(double f) {
    std::string text = "31\n", record;
    for (int i = 0; i < 31; ++i) {
        text += std::to_string(400 + 10 * i) + ' ';
        record += ' ' + std::to_string(f);
    }
    for (double thetaI : {0.0, 0.5, 1.0, 1.5})
        for (double thetaO : {0.0, 0.4, 0.8, 1.2})
            for (double phi : {0.0, 1.0, 2.0, 3.0})
                text += '\n' + std::to_string(thetaI) + " 0 " + std::to_string(thetaO) + ' ' +
                        std::to_string(phi) + record;
    return text;
}

/// Returns a MERL file of a single cell for the constant BRDF `f`.
std::string constantMerlFile(double f) {
    const int32_t size[3] = {1, 1, 1};
    std::string bytes(reinterpret_cast<const char*>(size), sizeof(size));
    for (double scale : {1 / 1500., 1.15 / 1500., 1.66 / 1500.}) {
        const double value = f / scale;
        bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
    }
    return bytes;
}

/// Measured materials with the constant BRDF albedo/π.
struct ConstantMeasurements {
    explicit ConstantMeasurements(double albedo) {
        std::vector<float> wavelengths, flat(31, 1.f);
        for (int i = 0; i < 31; ++i)
            wavelengths.push_back(float(400 + 10 * i));
        const Rgb white = spectrumToRgb(wavelengths, flat); // not (1, 1, 1): equal energy is not D65
        cases = {{measured(folder.write("constant.brdf", constantBrdfFile(albedo / M_PI))),
                  {albedo * white[0], albedo * white[1], albedo * white[2]}},
                 {measured(folder.write("constant.binary", constantMerlFile(albedo / M_PI))),
                  {albedo, albedo, albedo}}};
    }
    static std::string measured(const std::filesystem::path& file) {
        return R"("measured" "string filename" ")" + file.string() + '"';
    }
    struct Case {
        std::string material;
        std::vector<double> albedos; ///< RGB
    };
    test::TemporaryFolder folder;
    std::vector<Case> cases;
};

TEST(ClosedFurnace, HoldsForMeasuredMaterials) {
    const ConstantMeasurements measurements(.5);
    for (const auto& c : measurements.cases) {
        double expected = 0;
        for (double albedo : c.albedos)
            expected += .5 / (1 - albedo) / 3;
        for (const char* sampler : kSamplers)
            expectMean(test::build(closedFurnace(c.material, sampler, "all")), expected,
                       c.material + ' ' + sampler);
    }
}

/// Returns the directional albedo of the smooth lobes of a material for wo.z = mu, by quadrature of evalCos.
double directionalAlbedo(const Material& material, const Bsdf& bsdf, float mu) {
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

/// Returns the mean directional albedo over the picture of a sphere of radius 1 that shows the square |x|,
/// |y| < 1/2: at distance r from the axis, the cosine is sqrt(1 - r²).
double meanAlbedo(const BuiltScene& built) {
    const SurfacePoint s = built.scene->surface(Hit{kNone, 0, 0, 0.25f, 0.5f, 1}, 0);
    Bsdf bsdf;
    bsdf.material = s.material;
    s.material->prepare({}, bsdf);
    double sum = 0;
    constexpr int kGrid = 24;
    for (int i = 0; i < kGrid; ++i)
        for (int j = i; j < kGrid; ++j) {
            const float x = (float(i) + .5f) / kGrid / 2, y = (float(j) + .5f) / kGrid / 2;
            sum += (i == j ? 1 : 2) * directionalAlbedo(*s.material, bsdf, std::sqrt(1 - x * x - y * y));
        }
    return sum / (kGrid * kGrid);
}

/// Returns the scene of a sphere of radius 1 under an environment of radiance 1. `extent`: half of the
/// picture's width.
std::string whiteFurnace(const std::string& material, const std::string& sampler,
                         const std::string& integrator, const std::string& extent, int resolution) {
    const char* scene = R"(
        Film "image" "integer xresolution" $resolution "integer yresolution" $resolution
        $sampler
        Integrator $integrator
        Camera "orthographic" "float screenwindow" [-$extent $extent -$extent $extent]
        WorldBegin
        LightSource "infinite" "rgb L" [1 1 1]
        Material $material
        Translate 0 0 5
        Shape "sphere" "float radius" 1
    )";
    return test::substitute(scene, {{"$resolution", std::to_string(resolution)},
                                    {"$sampler", sampler},
                                    {"$integrator", integrator},
                                    {"$extent", extent},
                                    {"$material", material}});
}

/// Compares the picture of the center of a sphere in a white furnace with `albedo(scene)`.
void expectAlbedo(const std::string& material, const std::function<double(const BuiltScene&)>& albedo) {
    std::optional<double> expected;
    for (const char* sampler : kSamplers)
        for (const char* integrator : {R"("directlighting")", R"("path")"}) {
            const BuiltScene built =
                test::build(whiteFurnace(material, samplerLine(sampler, 8), integrator, ".5", 4));
            if (!expected)
                expected = albedo(built);
            expectMean(built, *expected, material + ' ' + sampler + ' ' + integrator, 16);
        }
}

TEST(WhiteFurnace, SphereShowsItsAlbedo) {
    for (const char* material :
         {R"("matte" "rgb Kd" [.7 .7 .7])", R"("matte" "rgb Kd" [.7 .7 .7] "float sigma" 30)",
          R"("plastic" "rgb Kd" [.3 .3 .3] "rgb Ks" [.4 .4 .4] "float roughness" .2)",
          R"("metal" "float roughness" .1)"})
        expectAlbedo(material, meanAlbedo);
}

TEST(WhiteFurnace, MeasuredSphereShowsItsAlbedo) {
    const ConstantMeasurements measurements(.7);
    for (const auto& c : measurements.cases)
        expectAlbedo(c.material,
                     [&](const BuiltScene&) { return (c.albedos[0] + c.albedos[1] + c.albedos[2]) / 3; });
}

TEST(WhiteFurnace, GlassAndMirrorConserveEnergy) {
    for (const std::string material : {R"("glass")", R"("mirror" "rgb Kr" [1 1 1])"})
        for (const char* sampler : kSamplers)
            expectMean(test::build(whiteFurnace(material, samplerLine(sampler, 4),
                                                R"("path" "integer maxdepth" 1000)", "1.2", 8)),
                       1, material + ' ' + sampler);
}

} // namespace
} // namespace strobe
