#include "materials/plastic.h"

#include "core/sampling.h"
#include "materials/blinn.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKd{"Kd", Rgb(.25f), "diffuse reflectance"};
const ParamDef<RgbInput> kKs{"Ks", Rgb(.25f), "factor of the gloss"};
const ParamDef<FloatInput> kRoughness{"roughness", .1f, "the Blinn exponent is 1/roughness, at most 10000"};

struct Data {
    PlainRgb scaledKd; ///< Kd/π
    PlainRgb ks;
    float exponent;
    float diffuse, gloss; ///< luminances of Kd and Ks
};

/// pbrt-v2's plastic evaluates Fresnel as if the light came from inside the dielectric: total reflection
/// beyond 41.8° from the half vector, where 4 % would be expected. Kept, to match its pictures.
float quirkyFresnel(float cosHalf) { return fresnelDielectric(cosHalf, 1.5f, 1.f); }

/// The probability of drawing from the gloss: its rough share of the albedo at wo. The Fresnel step at
/// sinθ = 1/1.5 is smeared by the width of the lobe.
float glossProbability(const Data& data, const V3f& wo) {
    if (data.gloss <= 0 || data.diffuse <= 0)
        return data.gloss > 0 ? 1.f : 0.f;
    const float sinO = safeSqrt(1 - wo.z * wo.z);
    const float smear = std::clamp((sinO - 1 / 1.5f) * std::sqrt(data.exponent + 1) / 2 + 0.5f, 0.f, 1.f);
    const float gloss = data.gloss * lerp(0.06f, 1.f, smear);
    return std::clamp(gloss / (gloss + data.diffuse), 0.1f, 0.9f);
}

class Plastic : public Material {
  public:
    Plastic(RgbInput kd, RgbInput ks, FloatInput roughness)
        : m_kd(std::move(kd)), m_ks(std::move(ks)), m_roughness(std::move(roughness)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        Data& data = bsdf.as<Data>();
        const Rgb kd = nonNegative(m_kd.at(q)), ks = nonNegative(m_ks.at(q));
        data.scaledKd = kd * kInvPi;
        data.ks = ks;
        data.exponent = blinnExponent(m_roughness.at(q));
        data.diffuse = luminance(kd);
        data.gloss = luminance(ks);
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Data& data = bsdf.as<Data>();
        const float probability = glossProbability(data, wo);
        float unwanted;
        for (int i = 0; i < n; ++i)
            evalOne(data, probability, wo, wi[i], f[i], pdf ? pdf[i] : unwanted);
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        const float probability = glossProbability(data, wo);
        if (uc < probability) {
            if (!sampleBlinn(data.exponent, wo, u, out.wi))
                return false;
        } else {
            out.wi = cosineHemisphere(u);
            if (wo.z < 0)
                out.wi.z = -out.wi.z;
        }
        Rgb f;
        evalOne(data, probability, wo, out.wi, f, out.pdf);
        if (!(out.pdf > 0))
            return false;
        out.weight = f / out.pdf;
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }

    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override {
        const Data& data = bsdf.as<Data>();
        const float probability = glossProbability(data, wo);
        const float diffuse = (1 - probability) * kInvPi;
        return probability > 0 ? diffuse + probability * maxBlinnPdf(data.exponent, wo) : diffuse;
    }
    bool isSmooth() const override { return true; }
    bool isDiffuse() const override { return true; }
    bool isTextured() const override { return m_kd.texture || m_ks.texture; }
    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& data = bsdf.as<Data>();
        return Rgb(data.scaledKd) * kPi + Rgb(data.ks);
    }
    bool needsFootprint() const override {
        return m_kd.needsFootprint() || m_ks.needsFootprint() || m_roughness.needsFootprint();
    }

  private:
    static void evalOne(const Data& data, float probability, const V3f& wo, const V3f& wi, Rgb& f,
                        float& pdf) {
        const MicrofacetTerm term = evalBlinn(data.exponent, wo, wi);
        f = data.scaledKd * std::abs(wi.z) + data.ks * (term.shape * quirkyFresnel(term.cosHalf));
        const float diffusePdf = wo.z * wi.z > 0 ? std::abs(wi.z) * kInvPi : 0.f;
        pdf = (1 - probability) * diffusePdf + probability * term.pdf;
    }

    RgbInput m_kd, m_ks;
    FloatInput m_roughness;
};

} // namespace

Plugin<std::shared_ptr<const Material>> plasticPlugin() {
    return {"plastic",
            "diffuse under a Blinn gloss, exactly as pbrt-v2's",
            {kKd, kKs, kRoughness},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Plastic>(params.get(kKd), params.get(kKs),
                                                       params.get(kRoughness));
            }};
}

} // namespace strobe
