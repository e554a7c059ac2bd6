#include "materials/matte.h"

#include "core/sampling.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKd{"Kd", Rgb(.5f), "diffuse reflectance", "reflectance"};
const ParamDef<FloatInput> kSigma{"sigma", 0.f,
                                  "roughness: standard deviation of the facets' slope angle, degrees"};

/// f = Kd/π (A + B max(0, cos(φi-φo)) sinα tanβ); Lambert has A = 1, B = 0.
struct Data {
    PlainRgb scaledKd; ///< Kd/π
    float a, b;
};

class Matte : public Material {
  public:
    Matte(RgbInput kd, FloatInput sigma) : m_kd(std::move(kd)), m_sigma(std::move(sigma)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        Data& data = bsdf.as<Data>();
        data.scaledKd = nonNegative(m_kd.at(q)) * kInvPi;
        const float s2 = sqr(radians(m_sigma.at(q)));
        data.a = 1 - s2 / (2 * (s2 + 0.33f));
        data.b = 0.45f * s2 / (s2 + 0.09f);
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Data& data = bsdf.as<Data>();
        const float cosO = std::abs(wo.z), side = wo.z < 0 ? -1.f : 1.f;
        for (int i = 0; i < n; ++i) {
            const float cosI = std::abs(wi[i].z);
            f[i] = data.scaledKd * (brightness(data, wo, wi[i], cosO, cosI) * cosI);
            if (pdf)
                pdf[i] = cosineHemispherePdf(side * wi[i].z);
        }
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        V3f wi = cosineHemisphere(u);
        out.pdf = cosineHemispherePdf(wi.z);
        if (!(out.pdf > 0))
            return false;
        if (wo.z < 0)
            wi.z = -wi.z;
        out.wi = wi;
        out.weight = data.scaledKd * (kPi * brightness(data, wo, wi, std::abs(wo.z), std::abs(wi.z)));
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }

    float maxPdf(const Bsdf&, const V3f&) const override { return kInvPi; }
    bool isSmooth() const override { return true; }
    bool isDiffuse() const override { return true; }
    bool isTextured() const override { return m_kd.texture != nullptr; }
    Rgb albedo(const Bsdf& bsdf) const override { return bsdf.as<Data>().scaledKd * kPi; }
    bool needsFootprint() const override { return m_kd.needsFootprint() || m_sigma.needsFootprint(); }

  private:
    /// A + B max(0, cos(φi-φo)) sinα tanβ, where sinα tanβ = sinθi sinθo / max(cosθi, cosθo): the product
    /// with the cosine is a dot product of the horizontal parts (Oren & Nayar 1994).
    static float brightness(const Data& data, const V3f& wo, const V3f& wi, float cosO, float cosI) {
        const float horizontal = std::max(0.f, wo.x * wi.x + wo.y * wi.y);
        return data.a + data.b * horizontal / std::max(std::max(cosO, cosI), 1e-6f);
    }

    RgbInput m_kd;
    FloatInput m_sigma;
};

} // namespace

Plugin<std::shared_ptr<const Material>> mattePlugin() {
    return {"matte",
            "diffuse: Lambert, or Oren-Nayar when sigma > 0",
            {kKd, kSigma},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Matte>(params.get(kKd), params.get(kSigma));
            }};
}

} // namespace strobe
