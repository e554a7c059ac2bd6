#include "materials/metal.h"

#include "materials/blinn.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"
#include "materials/lobe_soa.h"

namespace strobe {
namespace {

// Copper: pbrt-v2's Cu.eta.spd and Cu.k.spd, as spectrumToRgb converts them.
const ParamDef<RgbInput> kEta{"eta", Rgb(.20042f, .92405f, 1.10221f),
                              "index of refraction (default: copper)"};
const ParamDef<RgbInput> kK{"k", Rgb(3.91294f, 2.45284f, 2.14219f),
                            "absorption coefficient (default: copper)"};
const ParamDef<FloatInput> kRoughness{"roughness", .01f, "the Blinn exponent is 1/roughness, at most 10000"};

/// See LobeMaterial.
struct Data {
    float etaR, etaG, etaB, kR, kG, kB, exponent;

    STROBE_FORCE_INLINE LobeValue eval(const V3f& wo, const V3f& wi) const {
        const MicrofacetTerm term = evalBlinn(exponent, wo, wi);
        return {fresnelConductor(term.cosHalf, etaR, kR) * term.shape,
                fresnelConductor(term.cosHalf, etaG, kG) * term.shape,
                fresnelConductor(term.cosHalf, etaB, kB) * term.shape, term.pdf};
    }
    STROBE_FORCE_INLINE int32_t draw(const V3f& wo, float, const V2f& u, V3f& wi) const {
        return drawBlinn(exponent, wo, u, wi);
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

  private:
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
