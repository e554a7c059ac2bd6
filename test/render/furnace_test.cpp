// Closed furnaces and white worlds: pictures whose every pixel is known.
#include "core/sampling.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

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
    double sum = 0, sum2 = 0;
    for (int s = 0; s < seeds; ++s) {
        const Image image = test::render(built, uint64_t(s)).image;
        double mean = 0;
        for (const Rgb& p : image.pixels)
            mean += (p.x + p.y + p.z) / 3;
        mean /= double(image.pixels.size());
        sum += mean, sum2 += mean * mean;
    }
    const double mean = sum / seeds;
    const double error = std::sqrt(std::max(0.0, sum2 / seeds - mean * mean) / (seeds - 1));
    EXPECT_NEAR(mean, truth, test::criticalZ(1, seeds) * error + 2e-5 * truth) << what << " error " << error;
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
                const std::string text =
                    "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\n" +
                    samplerLine(sampler, 4) +
                    "Integrator \"path\" \"integer maxdepth\" 200 \"string strategy\" \"" + strategy +
                    "\"\nCamera \"perspective\" \"float fov\" 90\nWorldBegin\n"
                    "ReverseOrientation\nAreaLightSource \"diffuse\" \"rgb L\" [.5 .5 .5]\nMaterial " +
                    c.material + "\nTranslate .3 .2 0\nShape \"sphere\" \"float radius\" 1\n";
                expectMean(test::build(text), .5 / (1 - c.albedo),
                           std::string(c.material) + ' ' + sampler + ' ' + strategy);
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

TEST(WhiteWorld, SphereShowsTheAlbedo) {
    // A small sphere seen through an orthographic camera: at distance r of the axis the cosine is sqrt(1 -
    // r²).
    for (const char* material :
         {"\"matte\" \"rgb Kd\" [.7 .7 .7]", "\"matte\" \"rgb Kd\" [.7 .7 .7] \"float sigma\" 30",
          "\"plastic\" \"rgb Kd\" [.3 .3 .3] \"rgb Ks\" [.4 .4 .4] \"float roughness\" .2",
          "\"metal\" \"float roughness\" .1"})
        for (const char* sampler : kSamplers)
            for (const char* integrator : {"directlighting", "path"}) {
                const std::string text =
                    "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n" +
                    samplerLine(sampler, 8) + "Integrator \"" + integrator +
                    "\"\n"
                    "Camera \"orthographic\" \"float screenwindow\" [-.5 .5 -.5 .5]\nWorldBegin\n"
                    "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial " +
                    material + "\nTranslate 0 0 5\nShape \"sphere\" \"float radius\" 1\n";
                const BuiltScene built = test::build(text);
                // Average of the albedo over the picture: the square |x|,|y| < 1/2.
                const Hit hit{kNone, 0, 0, 0.25f, 0.5f, 1};
                const SurfacePoint s = built.scene->surface(hit, 0);
                Bsdf bsdf;
                bsdf.material = s.material;
                s.material->prepare({}, bsdf);
                double truth = 0;
                constexpr int kGrid = 24;
                for (int i = 0; i < kGrid; ++i)
                    for (int j = i; j < kGrid; ++j) {
                        const float x = (float(i) + .5f) / kGrid / 2, y = (float(j) + .5f) / kGrid / 2;
                        truth += (i == j ? 1 : 2) * albedoAt(*s.material, bsdf, std::sqrt(1 - x * x - y * y));
                    }
                truth /= kGrid * kGrid;
                expectMean(built, truth, std::string(material) + ' ' + sampler + ' ' + integrator, 16);
            }
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
