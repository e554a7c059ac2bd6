#include "materials/diffuse_transmission.h"

#include "core/math/sampling.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kReflectance{"reflectance", Rgb(.25f),  "albedo of the reflection",
                                      nullptr,       kUnlimited, kUnitRange};
const ParamDef<RgbInput> kTransmittance{"transmittance", Rgb(.25f),  "albedo of the transmission",
                                        nullptr,         kUnlimited, kUnitRange};
const ParamDef<float> kScale{"scale", 1, "factor of both", nullptr, kNotNegative};

struct Data {
    PlainRgb reflection, transmission; ///< albedos/π
    float reflects;                    ///< probability of sampling the reflection
};

class DiffuseTransmission final : public Material {
  public:
    DiffuseTransmission(RgbInput reflectance, RgbInput transmittance, float scale)
        : Material({.textured = reflectance.texture || transmittance.texture,
                    .transmissive = true,
                    .needsFootprint = reflectance.needsFootprint() || transmittance.needsFootprint()}),
          m_reflectance(std::move(reflectance)), m_transmittance(std::move(transmittance)), m_scale(scale) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        Rgb r = nonNegative(m_reflectance.at(q)) * m_scale, t = nonNegative(m_transmittance.at(q)) * m_scale;
        const float largest = std::max(maxComponent(r + t), 1.f);
        r = r / largest;
        t = t / largest;
        const float sum = luminance(r) + luminance(t);
        bsdf.as<Data>() = {Rgb(r * kInvPi), Rgb(t * kInvPi), sum > 0 ? luminance(r) / sum : 1.f};
    }
    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Data& d = bsdf.as<Data>();
        for (int i = 0; i < n; ++i) {
            const bool isReflection = wo.z * wi[i].z > 0;
            const float cosine = std::abs(wi[i].z);
            f[i] = Rgb(isReflection ? d.reflection : d.transmission) * cosine;
            if (pdf)
                pdf[i] = (isReflection ? d.reflects : 1 - d.reflects) * cosine * kInvPi;
        }
    }
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Data& d = bsdf.as<Data>();
        out.transmits = uc >= d.reflects;
        out.wi = cosineHemisphere(u);
        if ((wo.z < 0) != out.transmits)
            out.wi.z = -out.wi.z;
        const float probability = out.transmits ? 1 - d.reflects : d.reflects;
        out.pdf = probability * std::abs(out.wi.z) * kInvPi;
        out.weight = Rgb(out.transmits ? d.transmission : d.reflection) * (kPi / probability);
        out.delta = false;
        out.eta = 1;
        return out.pdf > 0;
    }
    float maxPdf(const Bsdf& bsdf, const V3f&) const override {
        const float p = bsdf.as<Data>().reflects;
        return std::max(p, 1 - p) * kInvPi;
    }
    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& d = bsdf.as<Data>();
        return (Rgb(d.reflection) + Rgb(d.transmission)) * kPi;
    }

  private:
    RgbInput m_reflectance, m_transmittance;
    float m_scale;
};

} // namespace

std::shared_ptr<const Material> makeDiffuseTransmission(RgbInput reflectance, RgbInput transmittance) {
    return std::make_shared<const DiffuseTransmission>(std::move(reflectance), std::move(transmittance), 1.f);
}

Plugin<std::shared_ptr<const Material>> diffuseTransmissionPlugin() {
    return {"diffusetransmission",
            "thin wall with diffuse reflection and diffuse transmission",
            {kReflectance, kTransmittance, kScale},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const DiffuseTransmission>(
                    params.get(kReflectance), params.get(kTransmittance), params.get(kScale));
            }};
}

} // namespace strobe
