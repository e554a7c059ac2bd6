#include "materials/plastic.h"

#include "core/math/sampling.h"
#include "materials/blinn.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"
#include "materials/lobe_soa.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKd{"Kd", Rgb(.25f), "diffuse reflectance"};
const ParamDef<RgbInput> kKs{"Ks", Rgb(.25f), "factor of the gloss"};
const ParamDef<FloatInput> kRoughness{"roughness", .1f, "the Blinn exponent is 1/roughness, at most 10000"};

/// pbrt-v2's plastic evaluates Fresnel as if the light came from inside the dielectric: total reflection
/// beyond 41.8° from the half vector, where 4 % would be expected. Kept, to match its pictures.
inline float quirkyFresnel(float cosHalf) { return fresnelDielectric(cosHalf, 1.5f, 1.f); }

/// See LobeMaterial.
struct Data {
    float r, g, b;    ///< Kd/π
    float kr, kg, kb; ///< Ks
    float exponent;
    float diffuse, gloss; ///< luminances of Kd and Ks

    /// The probability of drawing from the gloss: its rough share of the albedo at wo. The Fresnel step at
    /// sinθ = 1/1.5 is smeared by the width of the lobe.
    STROBE_FORCE_INLINE float glossProbability(const V3f& wo) const {
        const float sinO = safeSqrt(1 - wo.z * wo.z);
        const float smear =
            std::min(std::max((sinO - 1 / 1.5f) * std::sqrt(exponent + 1) / 2 + .5f, 0.f), 1.f);
        const float rough = gloss * lerp(.06f, 1.f, smear);
        const float share = std::min(std::max(rough / (rough + diffuse), .1f), .9f);
        const float only = gloss > 0 ? 1.f : 0.f;
        return gloss > 0 && diffuse > 0 ? share : only;
    }
    STROBE_FORCE_INLINE LobeValue eval(const V3f& wo, const V3f& wi) const {
        const MicrofacetTerm term = evalBlinn(exponent, wo, wi);
        const float cosine = std::abs(wi.z), glossy = term.shape * quirkyFresnel(term.cosHalf);
        const float diffusePdf = wo.z * wi.z > 0 ? cosine * kInvPi : 0.f;
        return {r * cosine + kr * glossy, g * cosine + kg * glossy, b * cosine + kb * glossy,
                lerp(diffusePdf, term.pdf, glossProbability(wo))};
    }
    STROBE_FORCE_INLINE int32_t draw(const V3f& wo, float uc, const V2f& u, V3f& wi) const {
        V3f glossy;
        const int32_t above = drawBlinn(exponent, wo, u, glossy);
        const bool isGloss = uc < glossProbability(wo);
        const V3f any = cosineHemisphere(u);
        const float z = wo.z < 0 ? -any.z : any.z;
        wi.x = isGloss ? glossy.x : any.x;
        wi.y = isGloss ? glossy.y : any.y;
        wi.z = isGloss ? glossy.z : z;
        return isGloss ? above : 1;
    }
    STROBE_FORCE_INLINE float maxPdf(const V3f& wo) const {
        const float probability = glossProbability(wo), bound = maxBlinnPdf(exponent, wo);
        return (1 - probability) * kInvPi + (probability > 0 ? probability * bound : 0);
    }
};

class Plastic : public LobeMaterial<Data> {
  public:
    Plastic(RgbInput kd, RgbInput ks, FloatInput roughness)
        : LobeMaterial(
              {.diffuse = true,
               .textured = kd.texture || ks.texture,
               .needsFootprint = kd.needsFootprint() || ks.needsFootprint() || roughness.needsFootprint()}),
          m_kd(std::move(kd)), m_ks(std::move(ks)), m_roughness(std::move(roughness)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        fill(m_kd.at(q), m_ks.at(q), blinnExponent(m_roughness.at(q)), bsdf);
    }
    void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const override {
        RgbSoA kd, ks;
        m_kd.atSoA(q, begin, end, kd), m_ks.atSoA(q, begin, end, ks);
        float exponent = blinnExponent(m_roughness.constant);
        for (int i = begin; i < end; ++i) {
            if (m_roughness.texture)
                exponent = blinnExponent(m_roughness.at(q.at(i)));
            fill(kd.at(i), ks.at(i), exponent, bsdf[i]);
        }
    }
    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& d = bsdf.as<Data>();
        return Rgb(d.r, d.g, d.b) * kPi + Rgb(d.kr, d.kg, d.kb);
    }

  private:
    static void fill(const Rgb& kdOrLess, const Rgb& ksOrLess, float exponent, Bsdf& bsdf) {
        const Rgb kd = nonNegative(kdOrLess), ks = nonNegative(ksOrLess), scaledKd = kd * kInvPi;
        bsdf.as<Data>() = {scaledKd.x, scaledKd.y, scaledKd.z,    ks.x,         ks.y,
                           ks.z,       exponent,   luminance(kd), luminance(ks)};
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
