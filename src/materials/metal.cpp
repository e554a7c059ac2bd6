#include "materials/metal.h"

#include "materials/blinn.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

// Copper: pbrt-v2's Cu.eta.spd and Cu.k.spd, as spectrumToRgb converts them.
const ParamDef<RgbInput> kEta{"eta", Rgb(.20042f, .92405f, 1.10221f),
                              "index of refraction (default: copper)"};
const ParamDef<RgbInput> kK{"k", Rgb(3.91294f, 2.45284f, 2.14219f),
                            "absorption coefficient (default: copper)"};
const ParamDef<FloatInput> kRoughness{"roughness", .01f, "the Blinn exponent is 1/roughness, at most 10000"};

struct Data {
    PlainRgb eta, k;
    float exponent;
};

class Metal : public Material {
  public:
    Metal(RgbInput eta, RgbInput k, FloatInput roughness)
        : m_eta(std::move(eta)), m_k(std::move(k)), m_roughness(std::move(roughness)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        bsdf.as<Data>() = {nonNegative(m_eta.at(q)), nonNegative(m_k.at(q)),
                           blinnExponent(m_roughness.at(q))};
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Data& data = bsdf.as<Data>();
        float unwanted;
        for (int i = 0; i < n; ++i)
            evalOne(data, wo, wi[i], f[i], pdf ? pdf[i] : unwanted);
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        if (!sampleBlinn(data.exponent, wo, u, out.wi))
            return false;
        Rgb f;
        evalOne(data, wo, out.wi, f, out.pdf);
        if (!(out.pdf > 0))
            return false;
        out.weight = f / out.pdf;
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }

    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override {
        return maxBlinnPdf(bsdf.as<Data>().exponent, wo);
    }
    bool isSmooth() const override { return true; }
    bool needsFootprint() const override {
        return m_eta.needsFootprint() || m_k.needsFootprint() || m_roughness.needsFootprint();
    }

  private:
    static void evalOne(const Data& data, const V3f& wo, const V3f& wi, Rgb& f, float& pdf) {
        const MicrofacetTerm term = evalBlinn(data.exponent, wo, wi);
        f = fresnelConductor(term.cosHalf, data.eta, data.k) * term.shape;
        pdf = term.pdf;
    }

    RgbInput m_eta, m_k;
    FloatInput m_roughness;
};

} // namespace

Plugin<std::shared_ptr<const Material>> metalPlugin() {
    return {"metal",
            "conductor with a Blinn gloss, as pbrt-v2's",
            {kEta, kK, kRoughness},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Metal>(params.get(kEta), params.get(kK),
                                                     params.get(kRoughness));
            }};
}

} // namespace strobe
