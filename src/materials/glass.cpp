#include "materials/glass.h"

#include "core/color/spectrum.h"
#include "materials/fresnel.h"
#include "materials/inputs.h"
#include "materials/microfacet.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKr{"Kr", Rgb(1), "scale of reflected light", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kKt{"Kt", Rgb(1), "scale of transmitted light", nullptr, kUnlimited, kUnitRange};
const ParamDef<FloatInput> kIndex{
    "index", 1.5f, "index of refraction of the inside relative to the outside", "eta", kUnlimited, kPositive};
const ParamDef<FloatInput> kRoughness{
    "roughness", 0.f,        "0: smooth; else mapped to the alpha of GGX as in the file's version of pbrt",
    nullptr,     kUnlimited, kNotNegative};
const ParamDef<FloatInput> kURoughness{"uroughness", 0.f,        "roughness along u; default: roughness",
                                       nullptr,      kUnlimited, kNotNegative};
const ParamDef<FloatInput> kVRoughness{"vroughness", 0.f,        "roughness along v; default: roughness",
                                       nullptr,      kUnlimited, kNotNegative};
const ParamDef<bool> kRemap{"remaproughness", true, "false: the roughness is alpha"};

/// Surfaces with a smaller alpha are smooth: their density exceeds the precision of float.
constexpr float kMinAlpha = 1e-3f;

struct Data {
    PlainRgb kr, kt;
    float index;
    float alphaU, alphaV; ///< 0: smooth
};

/// Reflection and transmission at one microfacet normal, or at the surface.
struct Interface {
    float eta;     ///< index on the far side of wo / index on wo's side
    float fresnel; ///< reflectance
    float reflectProbability;

    /// `cosO`: |cosine| between wo and the normal. `outside`: wo is on the outside.
    Interface(const Data& data, float cosO, bool outside)
        : eta(outside ? data.index : 1 / data.index), fresnel(fresnelDielectric(cosO, 1, eta)) {
        const float reflected = fresnel * maxComponent(data.kr);
        const float total = reflected + (1 - fresnel) * maxComponent(data.kt);
        reflectProbability = total > 0 ? reflected / total : -1; // -1: no light
    }
};

/// The rough lobes for one wo. All directions are mirrored such that wo is above the surface.
class RoughLobes {
  public:
    RoughLobes(const Data& data, const V3f& wo, bool scalesRadiance)
        : m_data(data), m_outside(wo.z > 0), m_wo(wo.x, wo.y, std::abs(wo.z)),
          m_scalesRadiance(scalesRadiance), m_alpha{data.alphaU, data.alphaV},
          m_ggx(m_wo, m_alpha, GgxAxes::Fixed) {}

    /// Writes f |cos wi| and the density per solid angle. `wi`: as the caller's.
    void eval(const V3f& wi, Rgb& f, float& pdf) const {
        f = Rgb(0);
        pdf = 0;
        const V3f w(wi.x, wi.y, m_outside ? wi.z : -wi.z);
        const bool isReflection = w.z > 0;
        const float etaI = isReflection ? 1 : m_outside ? m_data.index : 1 / m_data.index;
        V3f m = w * etaI + m_wo;
        const float l2 = length2(m);
        if (!(l2 > 1e-14f) || w.z == 0 || m_wo.z == 0)
            return;
        m *= (m.z < 0 ? -1 : 1) / std::sqrt(l2);
        const float cosO = dot(m_wo, m), cosI = dot(w, m); // on the microfacet
        if (cosO <= 0 || cosI * w.z <= 0)
            return;
        const Interface at(m_data, cosO, m_outside);
        const float d = ggxDistribution(m, m_alpha), visible = d * ggxMasking(m_wo, m_alpha) * cosO / m_wo.z;
        const float masked = d * ggxMasking(m_wo, w, m_alpha) / m_wo.z;
        if (isReflection) {
            f = Rgb(m_data.kr) * (at.fresnel * masked / 4);
            pdf = at.reflectProbability * visible / (4 * cosO);
            return;
        }
        const float slope = -cosI / sqr(cosI + cosO / etaI);
        f = Rgb(m_data.kt) * ((1 - at.fresnel) * masked * cosO * slope * radianceScale(etaI));
        pdf = (1 - at.reflectProbability) * visible * slope;
    }

    bool sample(float uc, const V2f& u, BsdfSample& out) const {
        const V3f m = m_ggx.sampleNormal(m_wo, u);
        const float cosO = std::min(dot(m_wo, m), 1.f);
        const Interface at(m_data, cosO, m_outside);
        if (!(cosO > 0) || at.reflectProbability < 0)
            return false;
        out.transmits = uc >= at.reflectProbability;
        out.eta = out.transmits ? at.eta : 1;
        const float cosT = safeSqrt(1 - (1 - sqr(cosO)) / sqr(at.eta));
        V3f w = out.transmits ? m * (cosO / at.eta - cosT) - m_wo * (1 / at.eta) : m * (2 * cosO) - m_wo;
        if ((w.z < 0) != out.transmits)
            return false;
        w = normalize(w);
        out.wi = {w.x, w.y, m_outside ? w.z : -w.z};
        Rgb f;
        eval(out.wi, f, out.pdf);
        out.weight = f * (1 / out.pdf);
        out.delta = false;
        return out.pdf > 0;
    }

    /// Returns a bound of the density. A transmitted density is at most that of the visible normals, which is
    /// at most 4 |cos| times the largest density of reflections, times the largest slope of refraction.
    float maxPdf() const {
        const float eta = m_outside ? m_data.index : 1 / m_data.index;
        return GgxReflection::maxPdf(m_wo, m_alpha, GgxAxes::Fixed) * std::max(1.f, 4 / sqr(1 - 1 / eta)) *
               1.001f;
    }

  private:
    float radianceScale(float eta) const { return m_scalesRadiance ? 1 / (eta * eta) : 1.f; }

    const Data& m_data;
    bool m_outside;
    V3f m_wo;
    bool m_scalesRadiance;
    GgxAlpha m_alpha;
    GgxReflection m_ggx;
};

class Glass : public Material {
  public:
    explicit Glass(const GlassInputs& inputs) : Material(flagsOf(inputs)), m_in(inputs) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        const float index = std::max(m_in.index.at(q), 1e-3f);
        const float u = alphaOf(m_in.uRoughness.at(q), m_in.rule),
                    v = alphaOf(m_in.vRoughness.at(q), m_in.rule);
        const bool isRough = flags().smooth && std::max(u, v) >= kMinAlpha && std::abs(index - 1) > 1e-3f;
        bsdf.as<Data>() = {nonNegative(m_in.kr.at(q)), nonNegative(m_in.kt.at(q)), index,
                           isRough ? std::max(u, kMinAlpha) : 0, isRough ? std::max(v, kMinAlpha) : 0};
    }
    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Data& data = bsdf.as<Data>();
        std::fill_n(f, n, Rgb(0));
        if (pdf)
            std::fill_n(pdf, n, 0.f);
        if (data.alphaU == 0)
            return;
        const RoughLobes lobes(data, wo, m_in.scalesRadiance);
        float ignoredPdf;
        for (int i = 0; i < n; ++i)
            lobes.eval(wi[i], f[i], pdf ? pdf[i] : ignoredPdf);
    }

    /// Picks reflection or transmission with probability proportional to its weight (largest channel).
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        return data.alphaU == 0 ? sampleSmooth(data, wo, uc, out)
                                : RoughLobes(data, wo, m_in.scalesRadiance).sample(uc, u, out);
    }
    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override {
        const Data& data = bsdf.as<Data>();
        return data.alphaU == 0 ? 0 : RoughLobes(data, wo, m_in.scalesRadiance).maxPdf();
    }
    bool isSpecular(const Bsdf&) const override { return true; }

  private:
    static MaterialFlags flagsOf(const GlassInputs& in) {
        const auto isRough = [](const FloatInput& r) { return r.texture || r.constant > 0; };
        const bool rough = isRough(in.uRoughness) || isRough(in.vRoughness);
        const bool isTextured = in.uRoughness.texture || in.vRoughness.texture || in.index.texture;
        const auto needFootprint = [](const auto&... inputs) { return (... || inputs.needsFootprint()); };
        return {.smooth = rough,
                .delta = rough && isTextured, // where it is smooth
                .transmissive = true,
                .needsFootprint = needFootprint(in.kr, in.kt, in.index, in.uRoughness, in.vRoughness),
                .needsTangents = rough && (in.uRoughness.texture || in.vRoughness.texture ||
                                           in.uRoughness.constant != in.vRoughness.constant),
                .usesDirectionSample = rough};
    }
    bool sampleSmooth(const Data& data, const V3f& wo, float uc, BsdfSample& out) const {
        const Interface at(data, std::abs(wo.z), wo.z > 0);
        if (at.reflectProbability < 0)
            return false;
        const float probability = at.reflectProbability;
        if (uc < probability) {
            out = {V3f(-wo.x, -wo.y, wo.z), data.kr * (at.fresnel / probability), 0, true, false, 1};
            return true;
        }
        const float eta = at.eta;
        const float cosT = safeSqrt(1 - (1 - wo.z * wo.z) / (eta * eta));
        const V3f wi(-wo.x / eta, -wo.y / eta, wo.z > 0 ? -cosT : cosT);
        const float scale = m_in.scalesRadiance ? 1 / (eta * eta) : 1.f;
        out = {normalize(wi), data.kt * ((1 - at.fresnel) / (1 - probability) * scale), 0, true, true, eta};
        return true;
    }

    GlassInputs m_in;
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

std::shared_ptr<const Material> makeGlass(const GlassInputs& inputs) {
    return std::make_shared<const Glass>(inputs);
}

Plugin<std::shared_ptr<const Material>> glassPlugin() {
    return {"glass",
            "boundary of a dielectric, smooth or rough: reflection and refraction",
            {kKr, kKt, kIndex, kRoughness, kURoughness, kVRoughness, kRemap},
            [](const ParamSet& params, const BuildContext& context) {
                GlassInputs in;
                in.kr = params.get(kKr);
                in.kt = params.get(kKt);
                in.index = indexFrom(params);
                const FloatInput both = params.get(kRoughness);
                in.uRoughness = params.has(kURoughness) ? params.get(kURoughness) : both;
                in.vRoughness = params.has(kVRoughness) ? params.get(kVRoughness) : both;
                in.rule = !params.get(kRemap)        ? RoughnessRule::Alpha
                          : context.pbrtVersion == 4 ? RoughnessRule::SquareRoot
                                                     : RoughnessRule::Polynomial;
                in.scalesRadiance = context.conventions != Conventions::PbrtV2;
                return makeGlass(in);
            }};
}

} // namespace strobe
