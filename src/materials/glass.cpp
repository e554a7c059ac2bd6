#include "materials/glass.h"

#include "core/color/spectrum.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKr{"Kr", Rgb(1), "scale of reflected light", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kKt{"Kt", Rgb(1), "scale of transmitted light", nullptr, kUnlimited, kUnitRange};
const ParamDef<FloatInput> kIndex{
    "index", 1.5f, "index of refraction of the inside relative to the outside", "eta", kUnlimited, kPositive};
const ParamDef<FloatInput> kRoughness{
    "roughness",
    0.f,
    "accepted for pbrt-v3 and pbrt-v4; values other than 0 render smooth, with a warning",
    nullptr,
    kUnlimited,
    kNotNegative};

struct Data {
    PlainRgb kr, kt;
    float index;
};

class Glass : public Material {
  public:
    Glass(RgbInput kr, RgbInput kt, FloatInput index, bool scalesRadiance)
        : Material({.smooth = false,
                    .transmissive = true,
                    .needsFootprint = kr.needsFootprint() || kt.needsFootprint() || index.needsFootprint(),
                    .usesDirectionSample = false}),
          m_kr(std::move(kr)), m_kt(std::move(kt)), m_index(std::move(index)),
          m_scalesRadiance(scalesRadiance) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        bsdf.as<Data>() = {nonNegative(m_kr.at(q)), nonNegative(m_kt.at(q)), std::max(m_index.at(q), 1e-3f)};
    }
    void evalCos(const Bsdf&, const V3f&, const V3f*, int n, Rgb* f, float* pdf) const override {
        std::fill_n(f, n, Rgb(0));
        if (pdf)
            std::fill_n(pdf, n, 0.f);
    }

    /// Picks reflection or transmission with probability proportional to its weight (largest channel).
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f&, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        const float etaO = wo.z > 0 ? 1.f : data.index, etaI = wo.z > 0 ? data.index : 1.f;
        const float fresnel = fresnelDielectric(std::abs(wo.z), etaO, etaI);
        const float reflected = fresnel * maxComponent(data.kr);
        const float total = reflected + (1 - fresnel) * maxComponent(data.kt);
        if (!(total > 0))
            return false;
        const float probability = reflected / total;
        if (uc < probability) {
            out = {V3f(-wo.x, -wo.y, wo.z), data.kr * (fresnel / probability), 0, true, false, 1};
            return true;
        }
        const float eta = etaI / etaO; // index on wi's side / index on wo's side
        const float cosT = safeSqrt(1 - (1 - wo.z * wo.z) / (eta * eta));
        const V3f wi(-wo.x / eta, -wo.y / eta, wo.z > 0 ? -cosT : cosT);
        const float scale = m_scalesRadiance ? 1 / (eta * eta) : 1.f;
        out = {normalize(wi), data.kt * ((1 - fresnel) / (1 - probability) * scale), 0, true, true, eta};
        return true;
    }
    float maxPdf(const Bsdf&, const V3f&) const override { return 0; }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const override {
        std::fill(out + jobs.begin, out + jobs.end, 0.f);
    }

  private:
    RgbInput m_kr, m_kt;
    FloatInput m_index;
    bool m_scalesRadiance; ///< scale transmitted radiance by 1/eta²; false under pbrt-v2's conventions
};

/// Returns the index of refraction. pbrt-v4 also accepts a spectrum ("glass-BK7"), of which the mean is
/// taken.
FloatInput indexFrom(const ParamSet& params) {
    const auto mean = [](const Rgb& c) { return (c.x + c.y + c.z) / 3; };
    for (const Param& p : params.all())
        if ((p.name == kIndex.name || p.name == kIndex.alias) && p.type == ParamType::Spectrum) {
            const float index = mean(params.get(ParamDef<Rgb>{p.name.c_str(), Rgb(1.5f), ""}));
            const bool isNamed = !p.strings.empty() && namedSpectrum(p.strings[0]);
            constexpr float kGreen = 550, kOne = 1; // a flat spectrum: spectrumToRgb has no white balance
            return isNamed ? index : index / mean(spectrumToRgb({&kGreen, 1}, {&kOne, 1}));
        }
    return params.get(kIndex);
}

} // namespace

Plugin<std::shared_ptr<const Material>> glassPlugin() {
    return {"glass",
            "smooth dielectric boundary: specular reflection and refraction",
            {kKr, kKt, kIndex, kRoughness},
            [](const ParamSet& params, const BuildContext& context) {
                const FloatInput roughness = params.get(kRoughness);
                if (roughness.texture || roughness.constant != 0)
                    context.diagnostics.warnOnce("glass roughness", params.whereIs(kRoughness),
                                                 "rough glass is not supported: it renders smooth");
                return std::make_shared<const Glass>(params.get(kKr), params.get(kKt), indexFrom(params),
                                                     context.conventions != Conventions::PbrtV2);
            }};
}

} // namespace strobe
