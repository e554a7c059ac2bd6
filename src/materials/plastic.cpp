#include "materials/plastic.h"

#include "core/math/sampling.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"
#include "materials/lobe_soa.h"
#include "materials/microfacet.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKd{"Kd", Rgb(.25f), "diffuse reflectance", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kKs{"Ks", Rgb(.25f), "scale of the glossy lobe", nullptr, kUnlimited, kUnitRange};
const ParamDef<FloatInput> kRoughness{
    "roughness", .1f,        "inverse of the Blinn exponent, which is at most 10000",
    nullptr,     kUnlimited, kNotNegative};

/// Returns pbrt-v2's Fresnel term of plastic. It is evaluated for light from inside the dielectric: 1 (total
/// internal reflection) beyond 41.8° from the half vector, where about 4 % would be expected. Kept for
/// equality with the images of pbrt-v2.
inline float pbrtFresnel(float cosHalf) { return fresnelDielectric(cosHalf, 1.5f, 1.f); }

/// The lobe of LobeMaterial.
struct Data {
    float r, g, b;    ///< Kd/π
    float kr, kg, kb; ///< Ks
    float exponent;
    float diffuse, gloss; ///< luminances of Kd and Ks

    /// Returns the probability of sampling the glossy lobe: its approximate fraction of the albedo for wo,
    /// limited to [.1, .9]. The Fresnel step at sinθ = 1/1.5 is smoothed by the width of the lobe.
    STROBE_FORCE_INLINE float glossProbability(const V3f& wo) const {
        const float sinO = safeSqrt(1 - wo.z * wo.z);
        const float step =
            std::min(std::max((sinO - 1 / 1.5f) * std::sqrt(exponent + 1) / 2 + .5f, 0.f), 1.f);
        const float glossAlbedo = gloss * lerp(.06f, 1.f, step);
        const float fraction = std::min(std::max(glossAlbedo / (glossAlbedo + diffuse), .1f), .9f);
        const float singleLobe = gloss > 0 ? 1.f : 0.f;
        return gloss > 0 && diffuse > 0 ? fraction : singleLobe;
    }
    STROBE_FORCE_INLINE LobeValue eval(const V3f& wo, const V3f& wi) const {
        const BlinnTerm term = evalBlinn(exponent, wo, wi);
        const float cosine = std::abs(wi.z), glossy = term.shape * pbrtFresnel(term.cosHalf);
        const float diffusePdf = wo.z * wi.z > 0 ? cosine * kInvPi : 0.f;
        return {r * cosine + kr * glossy, g * cosine + kg * glossy, b * cosine + kb * glossy,
                lerp(diffusePdf, term.pdf, glossProbability(wo))};
    }
    STROBE_FORCE_INLINE int32_t sampleDirection(const V3f& wo, float uc, const V2f& u, V3f& wi) const {
        V3f glossy;
        const int32_t above = sampleBlinn(exponent, wo, u, glossy);
        const bool isGloss = uc < glossProbability(wo);
        const V3f up = cosineHemisphere(u);
        const float diffuseZ = wo.z < 0 ? -up.z : up.z;
        wi.x = isGloss ? glossy.x : up.x;
        wi.y = isGloss ? glossy.y : up.y;
        wi.z = isGloss ? glossy.z : diffuseZ;
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
        m_kd.atSoA(q, begin, end, kd);
        m_ks.atSoA(q, begin, end, ks);
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
    static void fill(const Rgb& kdInput, const Rgb& ksInput, float exponent, Bsdf& bsdf) {
        const Rgb kd = nonNegative(kdInput), ks = nonNegative(ksInput), scaledKd = kd * kInvPi;
        bsdf.as<Data>() = {scaledKd.x, scaledKd.y, scaledKd.z,    ks.x,         ks.y,
                           ks.z,       exponent,   luminance(kd), luminance(ks)};
    }

    RgbInput m_kd, m_ks;
    FloatInput m_roughness;
};

} // namespace

Plugin<std::shared_ptr<const Material>> plasticPlugin() {
    return {"plastic",
            "diffuse lobe plus a Blinn lobe, with the values of pbrt-v2",
            {kKd, kKs, kRoughness},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Plastic>(params.get(kKd), params.get(kKs),
                                                       params.get(kRoughness));
            }};
}

} // namespace strobe
