#include "materials/metal.h"

#include "materials/fresnel.h"
#include "materials/inputs.h"
#include "materials/lobe_soa.h"
#include "materials/microfacet.h"

namespace strobe {
namespace {

// Copper: pbrt-v2's Cu.eta.spd and Cu.k.spd, converted by spectrumToRgb.
const ParamDef<RgbInput> kEta{"eta", Rgb(.20042f, .92405f, 1.10221f),
                              "index of refraction relative to the outside; the default is copper"};
const ParamDef<RgbInput> kK{"k", Rgb(3.91294f, 2.45284f, 2.14219f),
                            "absorption coefficient; the default is copper"};
const ParamDef<FloatInput> kRoughness{
    "roughness", .01f,       "inverse of the Blinn exponent, which is at most 10000",
    nullptr,     kUnlimited, kNotNegative};

/// The lobe of LobeMaterial.
struct Data {
    float etaR, etaG, etaB, kR, kG, kB, exponent;

    STROBE_FORCE_INLINE LobeValue eval(const V3f& wo, const V3f& wi) const {
        const BlinnTerm term = evalBlinn(exponent, wo, wi);
        return {fresnelConductor(term.cosHalf, etaR, kR) * term.shape,
                fresnelConductor(term.cosHalf, etaG, kG) * term.shape,
                fresnelConductor(term.cosHalf, etaB, kB) * term.shape, term.pdf};
    }
    STROBE_FORCE_INLINE int32_t sampleDirection(const V3f& wo, float, const V2f& u, V3f& wi) const {
        return sampleBlinn(exponent, wo, u, wi);
    }
    STROBE_FORCE_INLINE float maxPdf(const V3f& wo) const { return maxBlinnPdf(exponent, wo); }
};

class Metal : public LobeMaterial<Data> {
  public:
    Metal(RgbInput eta, RgbInput k, FloatInput roughness)
        : LobeMaterial(
              {.needsFootprint = eta.needsFootprint() || k.needsFootprint() || roughness.needsFootprint(),
               .usesLobeSample = false}),
          m_eta(std::move(eta)), m_k(std::move(k)), m_roughness(std::move(roughness)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        const Rgb eta = nonNegative(m_eta.at(q)), k = nonNegative(m_k.at(q));
        bsdf.as<Data>() = {eta.x, eta.y, eta.z, k.x, k.y, k.z, blinnExponent(m_roughness.at(q))};
    }
    bool isSpecular(const Bsdf&) const override { return true; }

  private:
    RgbInput m_eta, m_k;
    FloatInput m_roughness;
};

} // namespace

Plugin<std::shared_ptr<const Material>> metalPlugin() {
    return {"metal",
            "conductor with a Blinn lobe, as in pbrt-v2",
            {kEta, kK, kRoughness},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Metal>(params.get(kEta), params.get(kK),
                                                     params.get(kRoughness));
            }};
}

} // namespace strobe
