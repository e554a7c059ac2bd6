#include "materials/metallic_roughness.h"

#include "core/math/sampling.h"
#include "materials/ggx.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kBaseColor{"basecolor", Rgb(1), "diffuse albedo, or reflectance of a metal"};
const ParamDef<FloatInput> kMetallic{"metallic", 1.f, "0: dielectric, 1: metal"};
const ParamDef<FloatInput> kRoughness{"roughness", 1.f, "its square is GGX's alpha; below 0.03 a mirror"};
const ParamDef<FloatInput> kIor{"ior", 1.5f, "index of refraction of the dielectric"};
const ParamDef<FloatInput> kSpecular{"specular", 1.f, "factor of the dielectric's reflection"};
const ParamDef<RgbInput> kSpecularColor{"specularcolor", Rgb(1), "its color at normal incidence"};
const ParamDef<FloatInput> kTransmission{"transmission", 0.f,
                                         "how much goes through instead of being diffused; thin walls"};
const ParamDef<FloatInput> kClearcoat{"clearcoat", 0.f, "strength of a coat of lacquer"};
const ParamDef<FloatInput> kClearcoatRoughness{"clearcoatroughness", 0.f, "its roughness"};
const ParamDef<RgbInput> kNormalMap{"normalmap", Rgb(.5f, .5f, 1), "texture of tangent-space normals"};
const ParamDef<float> kNormalScale{"normalscale", 1.f, "factor of how far they lean"};

/// Lobes with a smaller alpha are exact mirrors: no float density follows them, and no pixel tells.
constexpr float kMinAlpha = 1e-3f;

struct Data {
    PlainRgb diffuse;      ///< albedo / π
    PlainRgb f0;           ///< reflectance at normal incidence, of dielectric and metal mixed
    float f90;             ///< at grazing incidence
    float skinF0, skinF90; ///< the dielectric's own, in its brightest channel: what its body does not get
    float alpha;           ///< 0: a mirror
    PlainRgb through;      ///< albedo of the transmission
    float coat, coatAlpha;
};

float clamp01(float x) { return std::clamp(x, 0.f, 1.f); } // NaN stays NaN: it is to be seen and reported
Rgb clamp01(const Rgb& c) { return {clamp01(c.x), clamp01(c.y), clamp01(c.z)}; }
float alphaOf(float roughness) {
    const float alpha = sqr(clamp01(roughness));
    return alpha < kMinAlpha ? 0 : alpha;
}

/// Schlick's factor of the way from f0 to f90.
inline float schlick(float cosine) {
    const float x = 1 - std::min(cosine, 1.f), x2 = x * x;
    return x2 * x2 * x;
}
inline Rgb fresnel(const Data& data, float cosine) {
    const float x = schlick(cosine);
    return Rgb(data.f0) * (1 - x) + Rgb(data.f90 * x);
}
/// What of the light gets through a dielectric's surface to its body. How much of the material is metal does
/// not matter there: glTF mixes a dielectric with a metal (glTF 2.0, appendix B.2).
inline float passed(const Data& data, float cosine) {
    const float x = schlick(cosine);
    return 1 - (data.skinF0 * (1 - x) + data.skinF90 * x);
}
constexpr float kCoatF0 = 0.04f;
inline float coatFresnel(const Data& data, float cosine) {
    return data.coat * (kCoatF0 + (1 - kCoatF0) * schlick(cosine));
}

/// Smith's masking of one direction.
inline float masking(float cosine, float alpha) {
    const float c = std::abs(cosine), a2 = sqr(alpha);
    return c > 0 ? 2 * c / (c + std::sqrt(a2 + (1 - a2) * sqr(c))) : 0;
}

/// The lobes' probabilities at wo: their rough shares of the albedo.
struct Shares {
    float gloss, diffuse, through, coat;

    Shares(const Data& data, const V3f& wo) {
        coat = coatFresnel(data, std::abs(wo.z));
        gloss = (1 - coat) * luminance(fresnel(data, std::abs(wo.z)));
        // Diffuse light comes in from where little of it is reflected, whatever wo is.
        diffuse = (1 - coat) * kPi * luminance(data.diffuse);
        through = (1 - coat) * luminance(data.through) * std::max(passed(data, std::abs(wo.z)), .1f);
        const float sum = gloss + diffuse + through + coat;
        const float scale = sum > 0 ? 1 / sum : 0;
        gloss *= scale, diffuse *= scale, through *= scale, coat *= scale;
    }
};

/// What does not depend on wi.
struct View {
    const Data& data;
    const V3f& wo;
    Shares shares;
    GgxReflection gloss, coat;

    View(const Data& d, const V3f& w)
        : data(d), wo(w), shares(d, w), gloss(w, ggx(d.alpha)), coat(w, ggx(d.coatAlpha)) {}
    static GgxAlpha ggx(float alpha) {
        const float a = std::max(alpha, kMinAlpha); // of a mirror it is not used
        return {a, a};
    }

    void eval(const V3f& wi, Rgb& f, float& pdf) const {
        f = Rgb(0), pdf = 0;
        const float cosHalf = safeSqrt((1 + dot(wo, wi)) / 2); // between either direction and the half vector
        if (wo.z * wi.z > 0)
            reflect(wi, cosHalf, f, pdf);
        else if (wo.z * wi.z < 0 && data.alpha > 0 && shares.through > 0)
            transmit(wi, f, pdf);
    }

  private:
    void reflect(const V3f& wi, float cosHalf, Rgb& f, float& pdf) const {
        const float cosine = std::abs(wi.z);
        f = Rgb(data.diffuse) * (passed(data, cosHalf) * cosine);
        pdf = shares.diffuse * cosine * kInvPi;
        if (data.alpha > 0) {
            const float density = gloss.pdf(wo, wi);
            f += fresnel(data, cosHalf) * (density * masking(wi.z, data.alpha));
            pdf += shares.gloss * density;
        }
        if (!(data.coat > 0))
            return;
        const float lacquer = coatFresnel(data, cosHalf);
        f *= 1 - lacquer;
        if (data.coatAlpha > 0) {
            const float density = coat.pdf(wo, wi);
            f += Rgb(lacquer * density * masking(wi.z, data.coatAlpha));
            pdf += shares.coat * density;
        }
    }

    /// Through thin walls light goes on as if it were reflected, and the picture turned over.
    void transmit(const V3f& wi, Rgb& f, float& pdf) const {
        const V3f mirrored(wi.x, wi.y, -wi.z);
        const float cosHalf = safeSqrt((1 + dot(wo, mirrored)) / 2), density = gloss.pdf(wo, mirrored);
        f = Rgb(data.through) *
            (passed(data, cosHalf) * density * masking(wi.z, data.alpha) * (1 - coatFresnel(data, cosHalf)));
        pdf = shares.through * density;
    }
};

class MetallicRoughness : public Material {
  public:
    explicit MetallicRoughness(MetallicRoughnessInputs inputs)
        : Material(flagsOf(inputs)), m_in(std::move(inputs)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        fill(q, m_in.baseColor.at(q), m_in.packed ? m_in.packed->rgb(q) : Rgb(1), bsdf);
    }
    void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const override {
        RgbSoA base, packed;
        m_in.baseColor.atSoA(q, begin, end, base);
        if (m_in.packed)
            m_in.packed->rgbSoA(q, begin, end, packed);
        for (int i = begin; i < end; ++i)
            fill(q.at(i), base.at(i), m_in.packed ? packed.at(i) : Rgb(1), bsdf[i]);
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const View view(bsdf.as<Data>(), wo);
        float unwanted;
        for (int i = 0; i < n; ++i)
            view.eval(wi[i], f[i], pdf ? pdf[i] : unwanted);
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        const View view(data, wo);
        const Shares& p = view.shares;
        out.eta = 1;
        if (uc < p.gloss) {
            if (data.alpha == 0)
                return mirror(data, wo, p.gloss, out);
            if (!view.gloss.draw(wo, u, out.wi))
                return false;
        } else if ((uc -= p.gloss) < p.coat) {
            if (data.coatAlpha == 0)
                return lacquer(data, wo, p.coat, out);
            if (!view.coat.draw(wo, u, out.wi))
                return false;
        } else if ((uc -= p.coat) < p.through) {
            if (data.alpha == 0)
                return window(data, wo, p.through, out);
            if (!view.gloss.draw(wo, u, out.wi))
                return false;
            out.wi.z = -out.wi.z;
        } else {
            out.wi = cosineHemisphere(u);
            if (wo.z < 0)
                out.wi.z = -out.wi.z;
        }
        Rgb f;
        view.eval(out.wi, f, out.pdf);
        if (!(out.pdf > 0))
            return false;
        out.weight = f / out.pdf;
        out.delta = false;
        out.transmits = wo.z * out.wi.z < 0;
        return true;
    }

    float maxPdf(const Bsdf& bsdf, const V3f& wo) const override {
        const Data& data = bsdf.as<Data>();
        const Shares shares(data, wo);
        float bound = shares.diffuse * kInvPi;
        if (data.alpha > 0) // reflection and transmission lie on different sides
            bound = std::max(bound + shares.gloss * GgxReflection::maxPdf(wo, View::ggx(data.alpha)),
                             shares.through * GgxReflection::maxPdf(wo, View::ggx(data.alpha)));
        if (data.coatAlpha > 0)
            bound += shares.coat * GgxReflection::maxPdf(wo, View::ggx(data.coatAlpha));
        return bound;
    }

    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& data = bsdf.as<Data>();
        return Rgb(data.diffuse) * kPi + Rgb(data.f0) + Rgb(data.through);
    }
    V3f tangentNormal(const TextureQuery& q) const override {
        const Rgb c = m_in.normalMap->rgb(q) * 2 - Rgb(1);
        return {c.x * m_in.normalScale, c.y * m_in.normalScale, c.z};
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
            textureNeeds(in.packed) || textureNeeds(in.normalMap);
        flags.shadingNormal = in.normalMap ? ShadingNormal::Mapped : ShadingNormal::Visible;
        return flags;
    }
    static bool delta(const V3f& wi, const Rgb& weight, bool transmits, BsdfSample& out) {
        out.wi = wi, out.weight = weight, out.pdf = 0, out.delta = true, out.transmits = transmits;
        return true;
    }
    static bool mirror(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        const float cosine = std::abs(wo.z);
        return delta({-wo.x, -wo.y, wo.z},
                     fresnel(data, cosine) * ((1 - coatFresnel(data, cosine)) / probability), false, out);
    }
    static bool lacquer(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        return delta({-wo.x, -wo.y, wo.z}, Rgb(coatFresnel(data, std::abs(wo.z)) / probability), false, out);
    }
    static bool window(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        const float cosine = std::abs(wo.z), share = passed(data, cosine) * (1 - coatFresnel(data, cosine));
        return delta(-wo, Rgb(data.through) * (share / probability), true, out);
    }

    void fill(const TextureQuery& q, const Rgb& baseOrMore, const Rgb& packed, Bsdf& bsdf) const {
        const Rgb base = clamp01(baseOrMore);
        const float metallic = clamp01(m_in.metallic.at(q) * packed.z);
        const float roughness = m_in.roughness.at(q) * packed.y;
        const float ior = std::max(m_in.ior.at(q), 0.f), specular = clamp01(m_in.specular.at(q));
        const Rgb f0 = clamp01(nonNegative(m_in.specularColor.at(q)) * sqr((ior - 1) / (ior + 1))) * specular;
        const float transmission = flags().transmissive ? clamp01(m_in.transmission.at(q)) : 0.f;
        const Rgb body = base * (1 - metallic);
        Data& data = bsdf.as<Data>();
        data.diffuse = body * ((1 - transmission) * kInvPi);
        data.through = body * transmission;
        data.f0 = f0 * (1 - metallic) + base * metallic;
        data.f90 = lerp(specular, 1, metallic);
        data.skinF0 = maxComponent(f0), data.skinF90 = specular;
        data.alpha = alphaOf(roughness);
        data.coat = clamp01(m_in.clearcoat.at(q));
        data.coatAlpha = alphaOf(m_in.clearcoatRoughness.at(q));
    }

    MetallicRoughnessInputs m_in;
};

} // namespace

std::shared_ptr<const Material> makeMetallicRoughness(const MetallicRoughnessInputs& inputs) {
    return std::make_shared<const MetallicRoughness>(inputs);
}

Plugin<std::shared_ptr<const Material>> metallicRoughnessPlugin() {
    return {"metallicroughness",
            "glTF's: diffuse, or metal, under a GGX gloss; thin transmission; clearcoat",
            {kBaseColor, kMetallic, kRoughness, kIor, kSpecular, kSpecularColor, kTransmission, kClearcoat,
             kClearcoatRoughness, kNormalMap, kNormalScale},
            [](const ParamSet& params, const BuildContext&) {
                MetallicRoughnessInputs in;
                in.baseColor = params.get(kBaseColor);
                in.metallic = params.get(kMetallic);
                in.roughness = params.get(kRoughness);
                in.ior = params.get(kIor);
                in.specular = params.get(kSpecular);
                in.specularColor = params.get(kSpecularColor);
                in.transmission = params.get(kTransmission);
                in.clearcoat = params.get(kClearcoat);
                in.clearcoatRoughness = params.get(kClearcoatRoughness);
                in.normalMap = params.get(kNormalMap).texture;
                in.normalScale = params.get(kNormalScale);
                return makeMetallicRoughness(in);
            }};
}

} // namespace strobe
