#include "materials/material_fixture.h"

#include "materials/matte.h"
#include "materials/measured.h"
#include "materials/metal.h"
#include "materials/metallic_roughness.h"
#include "materials/minnaert.h"
#include "materials/plastic.h"
#include "materials/plastic_v3.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace strobe::test {

MaterialPtr makeMaterial(const MaterialPlugin& plugin, const std::vector<Param>& params,
                         Conventions conventions) {
    ParamSet set;
    for (const Param& p : params)
        set.add(p);
    Diagnostics quiet;
    return plugin.create(set, BuildContext{quiet, conventions});
}

MaterialPtr texturedMaterial(const MaterialPlugin& plugin, const std::vector<std::string>& names,
                             const std::shared_ptr<const TextureTable>& table) {
    ParamSet set;
    for (const std::string& name : names)
        set.add({name, ParamType::Texture, {}, {}, {0, 0}, {"t"}});
    set.bindTextures(table);
    Diagnostics quiet;
    return plugin.create(set, BuildContext{quiet, Conventions::PbrtV4});
}

V3f Random::direction() {
    const float z = 2 * next() - 1, r = std::sqrt(std::max(0.f, 1 - z * z)), phi = 2 * kPi * next();
    return {r * std::cos(phi), r * std::sin(phi), z};
}

namespace {

/// Returns the "measured" material of a temporary file with these bytes.
MaterialPtr measuredFrom(const std::string& extension, const std::string& bytes) {
    const auto path =
        std::filesystem::temp_directory_path() / ("strobe-fixture-" + std::to_string(::getpid()) + extension);
    std::ofstream(path, std::ios::binary) << bytes;
    const MaterialPtr material = makeMaterial(measuredPlugin(), {stringParam("filename", path.string())});
    std::filesystem::remove(path);
    return material;
}

/// Returns a material of a .brdf file with value(θi, θo, Δφ) at `n` random pairs of directions, at two
/// wavelengths.
template <class Value>
MaterialPtr irregularExample(int n, Value value) {
    std::ostringstream file;
    file << "# made up\n2\n450 600 # nm\n";
    Random random(7);
    for (int i = 0; i < n; ++i) {
        const float ti = 1.5f * random.next(), to = 1.5f * random.next(), phi = kPi * random.next();
        const float v = value(ti, to, phi);
        file << ti << " 0 " << to << " " << phi << "  " << v << " " << v * .8f << "\n";
    }
    return measuredFrom(".brdf", file.str());
}

float smoothValue(float ti, float to, float phi) {
    return .1f + .05f * std::cos(ti) * std::cos(to) + .1f * sqr(phi / kPi) * std::sin(ti);
}

/// A glossy lobe of about 15° around the mirror direction.
float glossyValue(float ti, float to, float phi) {
    const V3f wi(std::sin(ti), 0, std::cos(ti));
    const V3f wo(std::sin(to) * std::cos(phi), std::sin(to) * std::sin(phi), std::cos(to));
    return .02f + std::pow(normalize(wi + wo).z, 60.f);
}

/// Returns a material of a MERL table: kd/π plus a Blinn lobe that depends on the half angle only.
MaterialPtr merlExample(double kd, double ks, double exponent) {
    const int32_t size[3] = {90, 30, 12}; // the database has 90 x 90 x 180
    std::string bytes(reinterpret_cast<const char*>(size), sizeof(size));
    for (const double scale : {1 / 1500., 1.15 / 1500., 1.66 / 1500.})
        for (int h = 0; h < size[0]; ++h) {
            const double thetaH = M_PI / 2 * std::pow((h + .5) / size[0], 2);
            const double value =
                kd / M_PI + ks * (exponent + 2) / (8 * M_PI) * std::pow(std::cos(thetaH), exponent);
            const double stored = value / scale;
            for (int rest = 0; rest < size[1] * size[2]; ++rest)
                bytes.append(reinterpret_cast<const char*>(&stored), sizeof(stored));
        }
    return measuredFrom(".binary", bytes);
}

class FixedTexture : public Texture {
  public:
    explicit FixedTexture(const Rgb& color) : m_color(color) {}
    Rgb rgb(const TextureQuery&) const override { return m_color; }

  private:
    Rgb m_color;
};

} // namespace

std::vector<NamedMaterial> smoothMaterials() {
    const auto plastic = [](float kd, float ks, float roughness) {
        return makeMaterial(plasticPlugin(), {rgbParam("Kd", Rgb(kd)), rgbParam("Ks", Rgb(ks)),
                                              floatParam("roughness", roughness)});
    };
    const auto plasticV3 = [](float kd, float ks, float alpha) {
        return makePlasticV3(Rgb(kd), Rgb(ks), alpha);
    };
    const auto matte = [](float kd, float sigma) {
        return makeMaterial(mattePlugin(), {rgbParam("Kd", Rgb(kd)), floatParam("sigma", sigma)});
    };
    const auto metal = [](float roughness) {
        return makeMaterial(metalPlugin(), {floatParam("roughness", roughness)});
    };
    const auto metallicRoughness = [](float base, float metallic, float roughness) {
        return makeMaterial(metallicRoughnessPlugin(),
                            {rgbParam("basecolor", Rgb(base)), floatParam("metallic", metallic),
                             floatParam("roughness", roughness)});
    };
    const auto anisotropic = [](float metallic, float u, float v) {
        return makeMaterial(metallicRoughnessPlugin(),
                            {rgbParam("basecolor", Rgb(.7f)), floatParam("metallic", metallic),
                             floatParam("roughness", u), floatParam("vroughness", v)});
    };
    const auto minnaert = [](float exponent) {
        return makeMaterial(minnaertPlugin(), {rgbParam("Kd", Rgb(1)), floatParam("exponent", exponent)});
    };
    const auto coated = [] {
        return makeMaterial(metallicRoughnessPlugin(),
                            {rgbParam("basecolor", Rgb(.5f)), floatParam("metallic", 0),
                             floatParam("roughness", .8f), floatParam("clearcoat", 1),
                             floatParam("clearcoatroughness", .3f)});
    };
    const auto belowBoundary = [](float base, float roughness) {
        MetallicRoughnessInputs in;
        in.baseColor = Rgb(base);
        in.metallic = 0;
        in.roughness = roughness;
        in.bodyBelowBoundary = true;
        return makeMetallicRoughness(in);
    };
    const auto gltf = [](float metallic, float roughness, const auto& change) {
        MetallicRoughnessInputs in;
        in.baseColor = Rgb(.6f, .5f, .4f);
        in.metallic = metallic;
        in.roughness = roughness;
        change(in);
        return makeMetallicRoughness(in);
    };
    const auto sheen = [&](float sheenRoughness) {
        return gltf(0, .7f, [&](MetallicRoughnessInputs& in) {
            in.sheenColor = Rgb(.9f, .5f, .3f);
            in.sheenRoughness = sheenRoughness;
        });
    };
    const auto iridescent = [&](float metallic) {
        return gltf(metallic, .5f, [](MetallicRoughnessInputs& in) { in.iridescence = 1; });
    };
    const auto stretched = gltf(1, .4f, [](MetallicRoughnessInputs& in) {
        in.anisotropy = .7f;
        in.anisotropyRotation = .6f;
    });
    const auto tiltedCoat = gltf(0, .8f, [](MetallicRoughnessInputs& in) {
        in.clearcoat = 1;
        in.clearcoatRoughness = .5f;
        in.clearcoatNormals = std::make_shared<FixedTexture>(Rgb(.65f, .4f, .95f));
    });
    return {{"metallic-roughness sheen", sheen(.3f)},
            {"metallic-roughness soft sheen", sheen(1)},
            {"metallic-roughness iridescent metal", iridescent(1)},
            {"metallic-roughness iridescent dielectric", iridescent(0)},
            {"metallic-roughness turned anisotropy", stretched},
            {"metallic-roughness tilted clearcoat", tiltedCoat, false, false, true, false},
            {"matte", matte(.5f, 0)},
            {"matte white", matte(1, 0)},
            {"matte black", matte(0, 0)},
            {"matte sigma 20", matte(1, 20)},
            {"matte sigma 90", matte(1, 90)},
            {"plastic", plastic(.25f, .25f, .1f)},
            {"plastic of the Killeroo", plastic(.4f, .3f, .15f)},
            {"plastic roughness 1", plastic(.5f, .5f, 1)},
            {"plastic roughness .001", plastic(.5f, .5f, .001f), true, true},
            {"plastic roughness 0", plastic(.2f, .8f, 0), true, true},
            {"plastic without gloss", plastic(1, 0, .1f)},
            {"plastic without diffuse", plastic(0, 1, .1f)},
            {"plastic white", plastic(1, 1, .1f), false},
            {"plastic of pbrt-v3", plasticV3(.25f, .25f, .3f), true, false, false},
            {"plastic of pbrt-v3, rough", plasticV3(.5f, .5f, 1), true, false, false},
            {"plastic of pbrt-v3, smooth", plasticV3(.2f, .8f, .02f), true, true, false},
            {"plastic of pbrt-v3 without gloss", plasticV3(1, 0, .3f), true, false, false},
            {"plastic of pbrt-v3 without diffuse", plasticV3(0, 1, .3f), true, false, false},
            {"metal", metal(.01f)},
            {"metal roughness .001", metal(.001f), true, true},
            {"metal roughness 1", metal(1)},
            {"metallic-roughness dielectric", metallicRoughness(.6f, 0, .5f)},
            {"metallic-roughness rough metal", metallicRoughness(.9f, 1, .9f)},
            {"metallic-roughness half metal", metallicRoughness(.8f, .5f, .3f)},
            {"metallic-roughness anisotropic", anisotropic(1, .4f, .8f)},
            {"metallic-roughness anisotropic dielectric", anisotropic(0, .9f, .3f)},
            {"metallic-roughness sharp metal", metallicRoughness(.9f, 1, .15f), true, true},
            {"metallic-roughness white", metallicRoughness(1, 0, .6f), false},
            {"metallic-roughness coated", coated()},
            {"metallic-roughness below its boundary", belowBoundary(.6f, .5f)},
            {"metallic-roughness white below its boundary", belowBoundary(1, .7f)},
            {"minnaert 2", minnaert(2)},
            {"minnaert 100", minnaert(100), true, true},
            {"measured", irregularExample(600, smoothValue)},
            {"measured glossy", irregularExample(3000, glossyValue)},
            {"measured, MERL even", merlExample(.5, 0, 1)},
            {"measured, MERL satin", merlExample(.3, .4, 100)},
            {"measured, MERL glossy", merlExample(.1, .6, 1000), true, true}};
}

std::vector<V3f> viewDirections() {
    std::vector<V3f> directions;
    for (const auto& [degrees, phi] : {std::pair{0.f, 0.f},
                                       {45.f, 1.f},
                                       {80.f, 2.5f},
                                       {89.5f, 4.f},
                                       {150.f, 5.f},
                                       {95.f, .3f},
                                       {180.f, 0.f}}) {
        const float theta = radians(degrees);
        directions.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                std::cos(theta));
    }
    return directions;
}

int Integrals::binOf(const V3f& w) {
    const float phi = std::atan2(w.y, w.x) + kPi;
    const int row = std::clamp(int((w.z + 1) / 2 * kRows), 0, kRows - 1);
    return row * kColumns + std::clamp(int(phi / (2 * kPi) * kColumns), 0, kColumns - 1);
}

namespace {

using Pair = std::array<double, 2>; ///< integrals of pdf and f |cos|

struct Quadrature {
    const Material& material;
    const Bsdf& bsdf;
    V3f wo, mirror;

    /// Integrates over a rectangle in (z, phi) by 3x3 Gauss-Legendre quadrature.
    Pair rule(double z0, double z1, double p0, double p1) const {
        static const double x[3] = {-.7745966692414834, 0, .7745966692414834};
        static const double w[3] = {5 / 18., 8 / 18., 5 / 18.};
        V3f wi[9];
        Rgb f[9];
        float pdf[9];
        for (int i = 0; i < 9; ++i) {
            const double z = (z0 + z1) / 2 + x[i / 3] * (z1 - z0) / 2;
            const double p = (p0 + p1) / 2 + x[i % 3] * (p1 - p0) / 2;
            const double r = std::sqrt(std::max(0., 1 - z * z));
            wi[i] = V3f(float(r * std::cos(p)), float(r * std::sin(p)), float(z));
        }
        material.evalCos(bsdf, wo, wi, 9, f, pdf);
        Pair sum{};
        for (int i = 0; i < 9; ++i) {
            const double weight = w[i / 3] * w[i % 3] * (z1 - z0) * (p1 - p0);
            sum[0] += weight * pdf[i];
            sum[1] += weight * (wi[i].z * wo.z > 0 ? f[i].y : 0);
        }
        return sum;
    }
    /// Subdivides the rectangle, whose integral by `rule` is `whole`, until the result converges.
    Pair refine(double z0, double z1, double p0, double p1, const Pair& whole, int depth) const {
        const double z = (z0 + z1) / 2, p = (p0 + p1) / 2;
        const double box[4][4] = {{z0, z, p0, p}, {z0, z, p, p1}, {z, z1, p0, p}, {z, z1, p, p1}};
        Pair quarters[4], sum{};
        for (int k = 0; k < 4; ++k) {
            quarters[k] = rule(box[k][0], box[k][1], box[k][2], box[k][3]);
            sum[0] += quarters[k][0];
            sum[1] += quarters[k][1];
        }
        const double error = std::abs(sum[0] - whole[0]) + std::abs(sum[1] - whole[1]);
        if (depth >= 9 || (depth >= 2 && error < 1e-6))
            return sum;
        sum = {};
        for (int k = 0; k < 4; ++k) {
            const Pair r = refine(box[k][0], box[k][1], box[k][2], box[k][3], quarters[k], depth + 1);
            sum[0] += r[0];
            sum[1] += r[1];
        }
        return sum;
    }
};

} // namespace

Integrals integrate(const Material& material, const Bsdf& bsdf, const V3f& wo) {
    Integrals result;
    const Quadrature quadrature{material, bsdf, wo, V3f(-wo.x, -wo.y, wo.z)};
    for (int row = 0; row < Integrals::kRows; ++row)
        for (int column = 0; column < Integrals::kColumns; ++column) {
            // Subdivides bins so finely that the nodes of the first rule miss no lobe.
            constexpr int kDivisions = 6;
            const double dz = 2. / Integrals::kRows / kDivisions;
            const double dp = 2 * M_PI / Integrals::kColumns / kDivisions;
            Pair sum{};
            for (int k = 0; k < kDivisions * kDivisions; ++k) {
                const double z = -1 + dz * (row * kDivisions + k / kDivisions);
                const double p = -M_PI + dp * (column * kDivisions + k % kDivisions);
                const Pair coarse = quadrature.rule(z, z + dz, p, p + dp);
                const V3f middle(float(std::sqrt(1 - sqr(float(z + dz / 2))) * std::cos(p + dp / 2)),
                                 float(std::sqrt(1 - sqr(float(z + dz / 2))) * std::sin(p + dp / 2)),
                                 float(z + dz / 2));
                const bool near = dot(middle, quadrature.mirror) > .9f;
                const Pair r = near || coarse[0] + coarse[1] > 1e-3
                                   ? quadrature.refine(z, z + dz, p, p + dp, coarse, 0)
                                   : coarse;
                sum[0] += r[0];
                sum[1] += r[1];
            }
            result.pdf.push_back(sum[0]);
            result.pdfTotal += sum[0];
            result.albedo += sum[1];
        }
    return result;
}

double sidakLevel(double alpha, int tests) { return 1 - std::pow(1 - alpha, 1. / tests); }

TEST(Statistics, SidakLevelOfManyTestsGivesTheTotalLevel) {
    EXPECT_NEAR(sidakLevel(.05, 1), .05, 1e-15);
    EXPECT_NEAR(1 - std::pow(1 - sidakLevel(.001, 200), 200), .001, 1e-12);
}

} // namespace strobe::test
