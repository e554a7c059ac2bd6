#include "materials/plastic_v3.h"

#include "core/math/sampling.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"
#include "materials/lobe_soa.h"
#include "materials/microfacet.h"

namespace strobe {
namespace {

/// Returns pbrt-v3's Fresnel term of plastic. On the outside of the surface, it is that of light from inside
/// the dielectric: 1 beyond 41.8° from the half vector. On the inside, it is that of light from outside.
STROBE_FORCE_INLINE float pbrtFresnel(float cosHalf, bool isOutside) {
    const float outside = fresnelDielectric(cosHalf, 1.5f, 1.f);
    const float inside = fresnelDielectric(cosHalf, 1.f, 1.5f);
    return isOutside ? outside : inside;
}

/// The lobe of LobeMaterial.
struct Data {
    float r, g, b;    ///< Kd/π
    float kr, kg, kb; ///< Ks
    float alpha;
    float diffuse, gloss; ///< luminances of Kd and Ks

    /// Returns the probability of sampling the glossy lobe: its approximate fraction of the albedo for wo,
    /// limited to [.1, .9]. On the outside, the Fresnel step at sinθ = 1/1.5 is smoothed by the width of the
    /// lobe.
    STROBE_FORCE_INLINE float glossProbability(const V3f& wo) const {
        const float sinO = safeSqrt(1 - wo.z * wo.z);
        const float step = std::min(std::max((sinO - 1 / 1.5f) / (alpha + .01f) + .5f, 0.f), 1.f);
        const float grazing = sqr(1 - std::min(std::abs(wo.z), 1.f));
        const float glossAlbedo = gloss * lerp(.06f, 1.f, wo.z > 0 ? step : sqr(grazing));
        const float fraction = std::min(std::max(glossAlbedo / (glossAlbedo + diffuse), .1f), .9f);
        const float singleLobe = gloss > 0 ? 1.f : 0.f;
        return gloss > 0 && diffuse > 0 ? fraction : singleLobe;
    }
    /// Returns 1 + Λ, Smith's masking term of GGX, times |w.z|.
    STROBE_FORCE_INLINE float masking(const V3f& w) const {
        const float cos2 = w.z * w.z;
        return (std::abs(w.z) + std::sqrt(cos2 + alpha * alpha * std::max(1 - cos2, 0.f))) / 2;
    }
    STROBE_FORCE_INLINE LobeValue eval(const V3f& wo, const V3f& wi) const {
        const GgxReflection ggx(wo, {alpha, alpha});
        const V3f sum = wo + wi;
        const float cosHalf = std::min(std::sqrt(length2(sum)) / 2, 1.f);
        const float cosI = std::abs(wi.z), cosO = std::abs(wo.z), density = ggx.pdf(wo, wi);
        // The density is G1(wo) D / (4 cosO). f cosI is D G F / (4 cosO) with the correlated masking
        // G = 1 / (1 + Λo + Λi).
        const float maskingO = masking(wo), maskingI = masking(wi);
        const float both = maskingO * cosI + maskingI * cosO - cosO * cosI; // (1 + Λo + Λi) cosO cosI
        const float glossy =
            density * maskingO * cosI / std::max(both, 1e-12f) * pbrtFresnel(cosHalf, sum.z > 0);
        const bool isReflection = wo.z * wi.z > 0;
        const float glossPdf = isReflection ? density : 0.f, diffusePdf = isReflection ? cosI * kInvPi : 0.f;
        return {r * cosI + kr * glossy, g * cosI + kg * glossy, b * cosI + kb * glossy,
                lerp(diffusePdf, glossPdf, glossProbability(wo))};
    }
    STROBE_FORCE_INLINE int32_t sampleDirection(const V3f& wo, float uc, const V2f& u, V3f& wi) const {
        V3f glossy;
        const int32_t above = GgxReflection(wo, {alpha, alpha}).sample(wo, u, glossy);
        const bool isGloss = uc < glossProbability(wo);
        const V3f up = cosineHemisphere(u);
        const float diffuseZ = wo.z < 0 ? -up.z : up.z;
        wi.x = isGloss ? glossy.x : up.x;
        wi.y = isGloss ? glossy.y : up.y;
        wi.z = isGloss ? glossy.z : diffuseZ;
        return isGloss ? above : 1;
    }
    STROBE_FORCE_INLINE float maxPdf(const V3f& wo) const {
        const float probability = glossProbability(wo);
        return (1 - probability) * kInvPi + probability * GgxReflection::maxPdf(wo, {alpha, alpha});
    }
};

class PlasticV3 : public LobeMaterial<Data> {
  public:
    PlasticV3(RgbInput kd, RgbInput ks, FloatInput alpha)
        : LobeMaterial(
              {.diffuse = true,
               .textured = kd.texture || ks.texture,
               .needsFootprint = kd.needsFootprint() || ks.needsFootprint() || alpha.needsFootprint()}),
          m_kd(std::move(kd)), m_ks(std::move(ks)), m_alpha(std::move(alpha)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        const Rgb kd = nonNegative(m_kd.at(q)), ks = nonNegative(m_ks.at(q)), scaledKd = kd * kInvPi;
        const float alpha = std::clamp(m_alpha.at(q), 1e-3f, 1.f);
        bsdf.as<Data>() = {scaledKd.x, scaledKd.y, scaledKd.z,    ks.x,         ks.y,
                           ks.z,       alpha,      luminance(kd), luminance(ks)};
    }
    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& d = bsdf.as<Data>();
        return Rgb(d.r, d.g, d.b) * kPi + Rgb(d.kr, d.kg, d.kb);
    }

  private:
    RgbInput m_kd, m_ks;
    FloatInput m_alpha;
};

} // namespace

std::shared_ptr<const Material> makePlasticV3(RgbInput kd, RgbInput ks, FloatInput alpha) {
    return std::make_shared<const PlasticV3>(std::move(kd), std::move(ks), std::move(alpha));
}

} // namespace strobe
