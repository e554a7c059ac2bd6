#include "materials/minnaert.h"

#include "core/params/params.h"
#include "materials/inputs.h"

namespace strobe {

namespace {

const ParamDef<RgbInput> kKd{"Kd", Rgb(.5f), "reflectance at normal incidence"};
constexpr float kMaxExponent = 100;
const ParamDef<float> kExponent{
    "exponent", 2, "1: Lambertian; larger: darker towards the silhouette", nullptr, {1, kMaxExponent}};

/// The values of the parameters at a surface point.
struct Data {
    PlainRgb kd;
};

class Minnaert : public Material {
  public:
    Minnaert(RgbInput kd, float exponent)
        : Material({.diffuse = true,
                    .textured = kd.texture != nullptr,
                    .needsFootprint = kd.needsFootprint(),
                    .usesLobeSample = false}),
          m_kd(std::move(kd)), m_exponent(exponent) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        bsdf.as<Data>() = {nonNegative(m_kd.at(q))};
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Rgb reflectance = reflectanceTo(bsdf, wo);
        for (int i = 0; i < n; ++i) {
            f[i] = reflectance * density(wi[i]);
            if (pdf)
                pdf[i] = wo.z * wi[i].z > 0 ? density(wi[i]) : 0;
        }
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float, const V2f& u, BsdfSample& out) const override {
        const float cosTheta = std::pow(u.x, 1 / (m_exponent + 1));
        const float sinTheta = safeSqrt(1 - cosTheta * cosTheta), phi = 2 * kPi * u.y;
        out.wi = {sinTheta * std::cos(phi), sinTheta * std::sin(phi), std::copysign(cosTheta, wo.z)};
        out.pdf = density(out.wi);
        out.weight = reflectanceTo(bsdf, wo);
        out.delta = false;
        out.transmits = false;
        out.eta = 1;
        return out.pdf > 0;
    }

    float maxPdf(const Bsdf&, const V3f&) const override { return density(V3f(0, 0, 1)); }

    Rgb albedo(const Bsdf& bsdf) const override { return bsdf.as<Data>().kd; }

  private:
    /// Returns (k+1)/(2π) |cosθ|^k, a density over each hemisphere.
    float density(const V3f& w) const {
        return (m_exponent + 1) / (2 * kPi) * std::pow(std::abs(w.z), m_exponent);
    }
    /// Returns the integral of f cosθi over wi: Kd |cosθo|^(k-1).
    Rgb reflectanceTo(const Bsdf& bsdf, const V3f& wo) const {
        return bsdf.as<Data>().kd * std::pow(std::abs(wo.z), m_exponent - 1);
    }

    const RgbInput m_kd;
    const float m_exponent;
};

} // namespace

Plugin<std::shared_ptr<const Material>> minnaertPlugin() {
    return {"minnaert",
            "diffuse reflection that darkens towards the silhouette",
            {kKd, kExponent},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Minnaert>(params.get(kKd), params.get(kExponent));
            }};
}

} // namespace strobe
