#include "materials/metallic_roughness.h"

#include "materials/metallic_roughness_lobes.h"

namespace strobe {

using namespace metallic_roughness;

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

class MetallicRoughness : public Material {
  public:
    explicit MetallicRoughness(MetallicRoughnessInputs inputs)
        : Material(flagsOf(inputs)), m_inputs(std::move(inputs)),
          m_hasSheen(m_inputs.sheenColor.texture || !isBlack(m_inputs.sheenColor.constant)),
          m_hasFilm(m_inputs.iridescence.texture || m_inputs.iridescence.constant > 0) {}

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
            if (!lobes.gloss.sample(lobes.glossWo, u, out.wi))
                return false;
            out.wi = turnedBack(data, out.wi);
        } else if ((uc -= p.gloss) < p.coat) {
            if (data.coatAlpha == 0)
                return sampleMirrorCoat(lobes, out);
            if (!lobes.coat.sample(lobes.coatWo, u, out.wi))
                return false;
            out.wi = fromCoat(data, out.wi);
            if (wo.z * out.wi.z <= 0)
                return false;
        } else if ((uc -= p.coat) < p.transmission) {
            if (data.alpha == 0)
                return sampleStraightThrough(data, wo, p.transmission, out);
            if (!lobes.gloss.sample(lobes.glossWo, u, out.wi))
                return false;
            out.wi = turnedBack(data, {out.wi.x, out.wi.y, -out.wi.z});
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
            const float glossPdf = GgxReflection::maxPdf(turned(data, wo), glossAlpha(data), glossAxes(data));
            bound = std::max(bound + p.gloss * glossPdf, p.transmission * glossPdf);
        }
        if (data.coatAlpha > 0)
            bound += p.coat * GgxReflection::maxPdf(toCoat(data, wo), LobesAt::ggx(data.coatAlpha));
        return bound;
    }

    bool isSpecular(const Bsdf& bsdf) const override {
        const Data& data = bsdf.as<Data>();
        return maxComponent(Rgb(data.diffuse)) <= 0 && data.coat <= 0 && !hasSheen(data);
    }

    Rgb albedo(const Bsdf& bsdf) const override {
        const Data& data = bsdf.as<Data>();
        return Rgb(data.diffuse) * kPi + Rgb(data.f0) + Rgb(data.transmission);
    }
    Rgb reflectance(const Bsdf& bsdf, const V3f& wo) const override {
        return metallic_roughness::reflectance(bsdf.as<Data>(), wo);
    }
    V3f mappedNormal(const TextureQuery& q, const TangentFrame& frame) const override {
        return m_inputs.normals ? m_inputs.normals->normal(q, frame) : frame.n;
    }

  private:
    static MaterialFlags flagsOf(const MetallicRoughnessInputs& in) {
        MaterialFlags flags;
        flags.smooth = flags.usesDirectionSample = !hasOnlyDeltaLobes(in);
        flags.delta = flags.smooth && mayHaveDeltaLobes(in);
        flags.transmissive = in.transmission.texture || in.transmission.constant > 0;
        flags.diffuse = in.metallic.constant < .5f && !flags.transmissive;
        flags.textured = in.baseColor.texture != nullptr;
        const auto needsFootprint = [](const auto&... inputs) { return (... || inputs.needsFootprint()); };
        const auto textureNeeds = [](const auto& texture) { return texture && texture->needsFootprint(); };
        flags.needsFootprint =
            needsFootprint(in.baseColor, in.metallic, in.roughness, in.ior, in.specular, in.specularColor,
                           in.transmission, in.clearcoat, in.clearcoatRoughness, in.sheenColor,
                           in.sheenRoughness, in.iridescence, in.iridescenceThickness) ||
            textureNeeds(in.packed) || textureNeeds(in.clearcoatNormals) || textureNeeds(in.anisotropyMap) ||
            (in.normals && in.normals->needsFootprint());
        flags.needsTangents = in.anisotropy > 0 || in.clearcoatNormals;
        if (in.vRoughness) {
            flags.needsTangents = true;
            flags.needsFootprint |= in.vRoughness->needsFootprint();
        }
        flags.shadingNormal = in.normals ? ShadingNormal::Mapped : ShadingNormal::Visible;
        return flags;
    }
    static bool isConstantMirror(const FloatInput& roughness) {
        return !roughness.texture && alphaOf(roughness.constant) == 0;
    }
    static bool hasCoat(const MetallicRoughnessInputs& in) {
        return in.clearcoat.texture || in.clearcoat.constant > 0;
    }
    /// Whether the material is a mirror, or a clear thin wall, at all points.
    static bool hasOnlyDeltaLobes(const MetallicRoughnessInputs& in) {
        const auto isAtLeast = [](const FloatInput& input, float value) {
            return !input.texture && input.constant >= value;
        };
        const bool hasBody = !isAtLeast(in.transmission, 1) && (!isAtLeast(in.metallic, 1) || in.packed);
        const bool hasSheen = in.sheenColor.texture || !isBlack(in.sheenColor.constant);
        return isConstantMirror(in.roughness) && (!in.vRoughness || isConstantMirror(*in.vRoughness)) &&
               !(in.anisotropy > 0) && !hasBody && !hasSheen &&
               (!hasCoat(in) || isConstantMirror(in.clearcoatRoughness));
    }
    /// Whether a lobe is a delta lobe at any point.
    static bool mayHaveDeltaLobes(const MetallicRoughnessInputs& in) {
        const auto mayBeMirror = [](const FloatInput& roughness) {
            return roughness.texture || alphaOf(roughness.constant) == 0;
        };
        const bool isMirror = in.packed || mayBeMirror(in.roughness);
        const bool isMirrorAlongV = !in.vRoughness || in.packed || mayBeMirror(*in.vRoughness);
        return (isMirror && isMirrorAlongV && !(in.anisotropy > 0)) ||
               (hasCoat(in) && mayBeMirror(in.clearcoatRoughness));
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
        const float sheen = hasSheen(data) ? sheenTransmittance(data, cosine, cosine) : 1;
        return setDelta({-wo.x, -wo.y, wo.z},
                        fresnel(data, cosine) * ((1 - coatFresnel(data, cosine)) * sheen / probability),
                        false, out);
    }
    static bool sampleMirrorCoat(const LobesAt& lobes, BsdfSample& out) {
        const V3f& wo = lobes.coatWo;
        const V3f wi = fromCoat(lobes.data, {-wo.x, -wo.y, wo.z});
        if (lobes.wo.z * wi.z <= 0)
            return false;
        return setDelta(wi, Rgb(coatFresnel(lobes.data, std::abs(wo.z)) / lobes.probabilities.coat), false,
                        out);
    }
    static bool sampleStraightThrough(const Data& data, const V3f& wo, float probability, BsdfSample& out) {
        const float cosine = std::abs(wo.z);
        const float sheen = hasSheen(data) ? sheenTransmittance(data, cosine, cosine) : 1;
        const float transmittance =
            dielectricTransmittance(data, cosine) * (1 - coatFresnel(data, cosine)) * sheen;
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
        if (m_inputs.vRoughness) {
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
        fillExtensions(q, data);
    }

    void fillExtensions(const TextureQuery& q, Data& data) const {
        data.sheen = m_hasSheen ? clamp01(m_inputs.sheenColor.at(q)) : Rgb(0);
        data.sheenRoughness = m_hasSheen ? clamp01(m_inputs.sheenRoughness.at(q)) : 0;
        data.film = m_hasFilm ? clamp01(m_inputs.iridescence.at(q)) : 0;
        data.filmIndex = std::max(m_inputs.iridescenceIor, 1.f);
        data.filmThickness = m_hasFilm ? std::max(m_inputs.iridescenceThickness.at(q), 0.f) : 0;
        data.turnCos = 1;
        data.turnSin = 0;
        if (m_inputs.anisotropy > 0)
            stretch(q, data);
        data.coatX = data.coatY = 0;
        if (m_inputs.clearcoatNormals)
            tiltCoat(m_inputs.clearcoatNormals->rgb(q), data);
    }
    /// Sets alpha along the direction of anisotropy: α + (1 - α) strength².
    void stretch(const TextureQuery& q, Data& data) const {
        float strength = m_inputs.anisotropy;
        V2f direction(1, 0);
        if (m_inputs.anisotropyMap) {
            const Rgb map = m_inputs.anisotropyMap->rgb(q);
            direction = {2 * map.x - 1, 2 * map.y - 1};
            strength *= map.z;
        }
        const float angle = m_inputs.anisotropyRotation + std::atan2(direction.y, direction.x);
        data.turnCos = std::cos(angle);
        data.turnSin = std::sin(angle);
        const float across = std::max(data.alpha, kMinAlpha);
        data.alpha = lerp(across, 1, sqr(clamp01(strength)));
        data.alphaV = across;
    }
    void tiltCoat(const Rgb& map, Data& data) const {
        const float scale = m_inputs.clearcoatNormalScale;
        const V3f n =
            normalize(V3f((2 * map.x - 1) * scale, (2 * map.y - 1) * scale, std::max(2 * map.z - 1, .05f)));
        data.coatX = n.x;
        data.coatY = n.y;
    }

    MetallicRoughnessInputs m_inputs;
    const bool m_hasSheen, m_hasFilm;
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
