#include "materials/metallic_roughness.h"

#include "core/math/sampling.h"
#include "materials/inputs.h"
#include "materials/microfacet.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kBaseColor{
    "basecolor", Rgb(1), "albedo of the dielectric body, or reflectance of the metal at normal incidence"};
const ParamDef<FloatInput> kMetallic{"metallic", 1.f, "mix of dielectric (0) and metal (1)"};
const ParamDef<FloatInput> kRoughness{"roughness", 1.f,
                                      "square root of GGX's alpha, 0 to 1; below 0.03: perfect mirror"};
const ParamDef<FloatInput> kVRoughness{
    "vroughness", 1.f, "roughness along dp/dv; \"roughness\" is then that along dp/du; default: roughness"};
const ParamDef<FloatInput> kIor{"ior", 1.5f, "index of refraction of the dielectric"};
const ParamDef<FloatInput> kSpecular{"specular", 1.f, "scale of the reflectance of the dielectric, 0 to 1"};
const ParamDef<RgbInput> kSpecularColor{"specularcolor", Rgb(1),
                                        "color of the reflectance of the dielectric at normal incidence"};
const ParamDef<FloatInput> kTransmission{
    "transmission", 0.f,
    "fraction of the body's light that is transmitted through a thin wall instead of diffused"};
const ParamDef<FloatInput> kClearcoat{"clearcoat", 0.f, "strength of the clearcoat, 0 to 1"};
const ParamDef<FloatInput> kClearcoatRoughness{
    "clearcoatroughness", 0.f, "square root of the clearcoat's GGX alpha; below 0.03: perfect mirror"};
const ParamDef<RgbInput> kNormalMap{"normalmap", Rgb(.5f, .5f, 1),
                                    "texture of tangent-space normals; (0.5, 0.5, 1): unperturbed"};
const ParamDef<float> kNormalScale{"normalscale", 1.f, "scale of the tilt of the mapped normals"};

/// Lobes with a smaller alpha are perfect mirrors: their density exceeds the precision of float, and the
/// difference is not visible.
constexpr float kMinAlpha = 1e-3f;

struct Data {
    PlainRgb diffuse; ///< albedo / π
    PlainRgb f0;      ///< reflectance at normal incidence, mixed from dielectric and metal
    float f90;        ///< reflectance at grazing incidence
    /// Reflectances of the dielectric alone, in the brightest channel; they reduce the light in its body.
    float dielectricF0, dielectricF90;
    float alpha, alphaV;   ///< of GGX along dp/du and dp/dv; 0: a mirror
    PlainRgb transmission; ///< albedo of the transmission
    float coat;            ///< strength of the clearcoat
    float coatAlpha;       ///< of GGX; 0: a mirror; negative: no coat, the body is below the boundary
};

float clamp01(float x) { return std::clamp(x, 0.f, 1.f); } // keeps NaN, which is reported per pixel
Rgb clamp01(const Rgb& c) { return {clamp01(c.x), clamp01(c.y), clamp01(c.z)}; }
float alphaOf(float roughness) {
    const float alpha = sqr(clamp01(roughness));
    return alpha < kMinAlpha ? 0 : alpha;
}

/// Returns the alpha of the gloss for GgxReflection; not used for mirrors.
GgxAlpha glossAlpha(const Data& data) {
    return {std::max(data.alpha, kMinAlpha), std::max(data.alphaV, kMinAlpha)};
}
GgxAxes glossAxes(const Data& data) {
    return data.alpha == data.alphaV ? GgxAxes::TurnWithWo : GgxAxes::Fixed;
}

/// Returns Schlick's weight of f90 against f0: (1 - cosine)^5.
inline float schlick(float cosine) {
    const float x = 1 - std::min(cosine, 1.f), x2 = x * x;
    return x2 * x2 * x;
}
inline Rgb fresnel(const Data& data, float cosine) {
    const float x = schlick(cosine);
    return Rgb(data.f0) * (1 - x) + Rgb(data.f90 * x);
}
/// Returns the fraction of light that passes the surface of the dielectric. It is independent of `metallic`,
/// because glTF mixes a complete dielectric with a metal (glTF 2.0, appendix B.2).
inline float dielectricTransmittance(const Data& data, float cosine) {
    const float x = schlick(cosine);
    return 1 - (data.dielectricF0 * (1 - x) + data.dielectricF90 * x);
}
inline bool bodyBelowBoundary(const Data& data) { return data.coatAlpha < 0; }
/// Returns the transmittance of a boundary above the body at the angles of wo and wi, relative to the mean
/// for diffuse light; the mean of (1 - cosine)^5 is 1/21. Not inlined, because other bodies would pay for it.
[[gnu::noinline]] float boundaryTransmittance(const Data& data, float cosO, float cosI) {
    const float mean = 1 - lerp(data.dielectricF0, data.dielectricF90, 1.f / 21);
    return dielectricTransmittance(data, cosO) * dielectricTransmittance(data, cosI) / std::max(mean, .01f);
}
constexpr float kCoatF0 = 0.04f;
inline float coatFresnel(const Data& data, float cosine) {
    return data.coat * (kCoatF0 + (1 - kCoatF0) * schlick(cosine));
}

/// Returns Smith's masking G1 of GGX for one direction.
inline float masking(float cosine, float alpha) {
    const float c = std::abs(cosine), a2 = sqr(alpha);
    return c > 0 ? 2 * c / (c + std::sqrt(a2 + (1 - a2) * sqr(c))) : 0;
}

/// Returns Smith's masking of the gloss.
inline float glossMasking(const Data& data, const V3f& w) {
    return data.alpha == data.alphaV ? masking(w.z, data.alpha) : ggxMasking(w, glossAlpha(data));
}

/// The probabilities of sampling the lobes, given wo: their approximate fractions of the albedo.
struct LobeProbabilities {
    float gloss, diffuse, transmission, coat;

    LobeProbabilities(const Data& data, const V3f& wo) {
        coat = coatFresnel(data, std::abs(wo.z));
        gloss = (1 - coat) * luminance(fresnel(data, std::abs(wo.z)));
        // Without the transmittance: most diffuse light arrives at angles of little reflection, for any wo.
        diffuse = (1 - coat) * kPi * luminance(data.diffuse);
        transmission = (1 - coat) * luminance(data.transmission) *
                       std::max(dielectricTransmittance(data, std::abs(wo.z)), .1f);
        const float sum = gloss + diffuse + transmission + coat;
        const float scale = sum > 0 ? 1 / sum : 0;
        gloss *= scale;
        diffuse *= scale;
        transmission *= scale;
        coat *= scale;
    }
};

/// The lobes for one wo: all values that do not depend on wi.
struct LobesAt {
    const Data& data;
    const V3f& wo;
    LobeProbabilities probabilities;
    GgxReflection gloss, coat;

    LobesAt(const Data& d, const V3f& w)
        : data(d), wo(w), probabilities(d, w), gloss(w, glossAlpha(d), glossAxes(d)),
          coat(w, ggx(d.coatAlpha)) {}
    static GgxAlpha ggx(float alpha) {
        const float a = std::max(alpha, kMinAlpha); // the result is not used for mirrors
        return {a, a};
    }

    /// Writes f |cos wi| and the density per solid angle of all smooth lobes.
    void eval(const V3f& wi, Rgb& f, float& pdf) const {
        f = Rgb(0);
        pdf = 0;
        if (wo.z * wi.z > 0)
            evalReflection(wi, f, pdf);
        else if (wo.z * wi.z < 0 && data.alpha > 0 && probabilities.transmission > 0)
            evalTransmission(wi, f, pdf);
    }

  private:
    void evalReflection(const V3f& wi, Rgb& f, float& pdf) const {
        const float cosHalf = safeSqrt((1 + dot(wo, wi)) / 2); // between wo (or wi) and the half vector
        const float cosine = std::abs(wi.z);
        float transmittance = dielectricTransmittance(data, cosHalf);
        if (bodyBelowBoundary(data)) [[unlikely]]
            transmittance = boundaryTransmittance(data, std::abs(wo.z), cosine);
        f = Rgb(data.diffuse) * (transmittance * cosine);
        pdf = probabilities.diffuse * cosine * kInvPi;
        if (data.alpha > 0) {
            const float density = gloss.pdf(wo, wi);
            f += fresnel(data, cosHalf) * (density * glossMasking(data, wi));
            pdf += probabilities.gloss * density;
        }
        if (!(data.coat > 0))
            return;
        const float reflected = coatFresnel(data, cosHalf);
        f *= 1 - reflected;
        if (data.coatAlpha > 0) {
            const float density = coat.pdf(wo, wi);
            f += Rgb(reflected * density * masking(wi.z, data.coatAlpha));
            pdf += probabilities.coat * density;
        }
    }

    /// Transmission through a thin wall is the reflection lobe mirrored at the surface.
    void evalTransmission(const V3f& wi, Rgb& f, float& pdf) const {
        const V3f mirrored(wi.x, wi.y, -wi.z);
        const float cosHalf = safeSqrt((1 + dot(wo, mirrored)) / 2), density = gloss.pdf(wo, mirrored);
        f = Rgb(data.transmission) * (dielectricTransmittance(data, cosHalf) * density *
                                      glossMasking(data, mirrored) * (1 - coatFresnel(data, cosHalf)));
        pdf = probabilities.transmission * density;
    }
};

class MetallicRoughness : public Material {
  public:
    explicit MetallicRoughness(MetallicRoughnessInputs inputs)
        : Material(flagsOf(inputs)), m_inputs(std::move(inputs)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        fill(q, m_inputs.baseColor.at(q), m_inputs.packed ? m_inputs.packed->rgb(q) : Rgb(1), bsdf);
    }
    void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const override {
        RgbSoA base, packed;
        m_inputs.baseColor.atSoA(q, begin, end, base);
        if (m_inputs.packed)
            m_inputs.packed->rgbSoA(q, begin, end, packed);
        for (int i = begin; i < end; ++i)
            fill(q.at(i), base.at(i), m_inputs.packed ? packed.at(i) : Rgb(1), bsdf[i]);
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const LobesAt lobes(bsdf.as<Data>(), wo);
        float ignoredPdf;
        for (int i = 0; i < n; ++i)
            lobes.eval(wi[i], f[i], pdf ? pdf[i] : ignoredPdf);
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        const LobesAt lobes(data, wo);
        const LobeProbabilities& p = lobes.probabilities;
        out.eta = 1;
        if (uc < p.gloss) {
            if (data.alpha == 0)
                return sampleMirror(data, wo, p.gloss, out);
            if (!lobes.gloss.sample(wo, u, out.wi))
                return false;
        } else if ((uc -= p.gloss) < p.coat) {
            if (data.coatAlpha == 0)
                return sampleMirrorCoat(data, wo, p.coat, out);
            if (!lobes.coat.sample(wo, u, out.wi))
                return false;
        } else if ((uc -= p.coat) < p.transmission) {
            if (data.alpha == 0)
                return sampleStraightThrough(data, wo, p.transmission, out);
            if (!lobes.gloss.sample(wo, u, out.wi))
                return false;
            out.wi.z = -out.wi.z;
        } else {
            out.wi = cosineHemisphere(u);
            if (wo.z < 0)
                out.wi.z = -out.wi.z;
        }
        Rgb f;
        lobes.eval(out.wi, f, out.pdf);
        if (!(out.pdf > 0))
            return false;
        out.weight = f / out.pdf;
        out.delta = false;
        out.transmits = wo.z * out.wi.z < 0;
        return true;
    }

    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override {
        const Data& data = bsdf.as<Data>();
        const LobeProbabilities p(data, wo);
        float bound = p.diffuse * kInvPi;
        if (data.alpha > 0) { // reflection and transmission are on different sides
            const float glossPdf = GgxReflection::maxPdf(wo, glossAlpha(data), glossAxes(data));
            bound = std::max(bound + p.gloss * glossPdf, p.transmission * glossPdf);
        }
        if (data.coatAlpha > 0)
            bound += p.coat * GgxReflection::maxPdf(wo, LobesAt::ggx(data.coatAlpha));
        return bound;
    }

    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& data = bsdf.as<Data>();
        return Rgb(data.diffuse) * kPi + Rgb(data.f0) + Rgb(data.transmission);
    }
    V3f mappedNormal(const TextureQuery& q, const TangentFrame& frame) const override {
        return m_inputs.normals ? m_inputs.normals->normal(q, frame) : frame.n;
    }

  private:
    static MaterialFlags flagsOf(const MetallicRoughnessInputs& in) {
        MaterialFlags flags;
        flags.transmissive = in.transmission.texture || in.transmission.constant > 0;
        flags.diffuse = in.metallic.constant < .5f && !flags.transmissive;
        flags.textured = in.baseColor.texture != nullptr;
        const auto needsFootprint = [](const auto&... inputs) { return (... || inputs.needsFootprint()); };
        const auto textureNeeds = [](const auto& texture) { return texture && texture->needsFootprint(); };
        flags.needsFootprint =
            needsFootprint(in.baseColor, in.metallic, in.roughness, in.ior, in.specular, in.specularColor,
                           in.transmission, in.clearcoat, in.clearcoatRoughness) ||
            textureNeeds(in.packed) || (in.normals && in.normals->needsFootprint());
        if (in.vRoughness) {
            flags.needsTangents = true;
            flags.needsFootprint |= in.vRoughness->needsFootprint();
        }
        flags.shadingNormal = in.normals ? ShadingNormal::Mapped : ShadingNormal::Visible;
        return flags;
    }
    static bool setDelta(const V3f& wi, const Rgb& weight, bool transmits, BsdfSample& out) {
        out.wi = wi;
        out.weight = weight;
        out.pdf = 0;
        out.delta = true;
        out.transmits = transmits;
        return true;
    }
    // Samples of lobes with alpha 0, which are picked with `probability`.
    static bool sampleMirror(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        const float cosine = std::abs(wo.z);
        return setDelta({-wo.x, -wo.y, wo.z},
                        fresnel(data, cosine) * ((1 - coatFresnel(data, cosine)) / probability), false, out);
    }
    static bool sampleMirrorCoat(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        return setDelta({-wo.x, -wo.y, wo.z}, Rgb(coatFresnel(data, std::abs(wo.z)) / probability), false,
                        out);
    }
    static bool sampleStraightThrough(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        const float cosine = std::abs(wo.z);
        const float transmittance = dielectricTransmittance(data, cosine) * (1 - coatFresnel(data, cosine));
        return setDelta(-wo, Rgb(data.transmission) * (transmittance / probability), true, out);
    }

    void fill(const TextureQuery& q, const Rgb& baseColor, const Rgb& packed, Bsdf& bsdf) const {
        const Rgb base = clamp01(baseColor);
        const float metallic = clamp01(m_inputs.metallic.at(q) * packed.z);
        const float roughness = m_inputs.roughness.at(q) * packed.y;
        const float ior = std::max(m_inputs.ior.at(q), 0.f), specular = clamp01(m_inputs.specular.at(q));
        const Rgb f0 =
            clamp01(nonNegative(m_inputs.specularColor.at(q)) * sqr((ior - 1) / (ior + 1))) * specular;
        const float transmission = flags().transmissive ? clamp01(m_inputs.transmission.at(q)) : 0.f;
        const Rgb body = base * (1 - metallic);
        Data& data = bsdf.as<Data>();
        data.diffuse = body * ((1 - transmission) * kInvPi);
        data.transmission = body * transmission;
        data.f0 = f0 * (1 - metallic) + base * metallic;
        data.f90 = lerp(specular, 1, metallic);
        data.dielectricF0 = maxComponent(f0);
        data.dielectricF90 = specular;
        data.alpha = data.alphaV = alphaOf(roughness);
        if (flags().needsTangents) {
            data.alphaV = alphaOf(m_inputs.vRoughness->at(q) * packed.y);
            if (data.alpha != data.alphaV) { // a mirror is one in both directions
                data.alpha = std::max(data.alpha, kMinAlpha);
                data.alphaV = std::max(data.alphaV, kMinAlpha);
            }
        }
        data.coat = clamp01(m_inputs.clearcoat.at(q));
        data.coatAlpha = alphaOf(m_inputs.clearcoatRoughness.at(q));
        if (m_inputs.bodyBelowBoundary && !(data.coat > 0))
            data.coatAlpha = -1;
    }

    MetallicRoughnessInputs m_inputs;
};

} // namespace

std::shared_ptr<const Material> makeMetallicRoughness(const MetallicRoughnessInputs& inputs) {
    return std::make_shared<const MetallicRoughness>(inputs);
}

Plugin<std::shared_ptr<const Material>> metallicRoughnessPlugin() {
    return {"metallicroughness",
            "glTF's metallic-roughness model: diffuse, GGX reflection, thin transmission, clearcoat",
            {kBaseColor, kMetallic, kRoughness, kVRoughness, kIor, kSpecular, kSpecularColor, kTransmission,
             kClearcoat, kClearcoatRoughness, kNormalMap, kNormalScale},
            [](const ParamSet& params, const BuildContext&) {
                MetallicRoughnessInputs in;
                in.baseColor = params.get(kBaseColor);
                in.metallic = params.get(kMetallic);
                in.roughness = params.get(kRoughness);
                if (params.has(kVRoughness))
                    in.vRoughness = params.get(kVRoughness);
                in.ior = params.get(kIor);
                in.specular = params.get(kSpecular);
                in.specularColor = params.get(kSpecularColor);
                in.transmission = params.get(kTransmission);
                in.clearcoat = params.get(kClearcoat);
                in.clearcoatRoughness = params.get(kClearcoatRoughness);
                if (const TexturePtr map = params.get(kNormalMap).texture)
                    in.normals = makeNormalMap(map, params.get(kNormalScale));
                return makeMetallicRoughness(in);
            }};
}

} // namespace strobe
