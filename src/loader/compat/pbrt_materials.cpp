#include "loader/compat/pbrt_compat.h"

#include "loader/compat/pbrt_coats.h"
#include "loader/compat/pbrt_inputs.h"
#include "materials/diffuse_transmission.h"
#include "materials/glass.h"
#include "materials/matte.h"
#include "materials/metallic_roughness.h"
#include "materials/mirror.h"
#include "materials/plastic.h"
#include "materials/plastic_v3.h"

namespace strobe {
namespace {

using MaterialPtr = std::shared_ptr<const Material>;

// Parameters of several materials. Materials with other defaults override them where they read the parameter.
const ParamDef<RgbInput> kKd{"Kd", Rgb(.25f), "diffuse reflectance", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kKs{"Ks", Rgb(.25f), "glossy reflectance", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kKr{"Kr", Rgb(0), "specular reflectance", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kKt{"Kt", Rgb(0), "specular transmittance", nullptr, kUnlimited, kUnitRange};
const ParamDef<RgbInput> kReflectance{"reflectance", Rgb(.5f),   "reflectance",
                                      nullptr,       kUnlimited, kUnitRange};
const ParamDef<FloatInput> kEta{"eta", 1.5f, "index of refraction", "index", kUnlimited, kPositive};
const ParamDef<FloatInput> kURoughness{"uroughness", 0.f, "roughness along u"};
const ParamDef<FloatInput> kVRoughness{"vroughness", 0.f, "roughness along v"};
const ParamDef<Rgb> kMetalEta{"eta", Rgb(.20042f, .92405f, 1.10221f), "index of refraction"};
const ParamDef<Rgb> kMetalK{"k", Rgb(3.91294f, 2.45284f, 2.14219f), "absorption coefficient"};

RoughnessDefs roughnessDefs(float fallback) {
    return {{"roughness", fallback, "roughness"}, kURoughness, kVRoughness};
}

RoughnessRule roughnessRule(const BuildContext& context) {
    return context.conventions == Conventions::PbrtV2 ? RoughnessRule::BlinnExponent
                                                      : RoughnessRule::Polynomial;
}

template <class T>
ParamDef<T> withDefault(ParamDef<T> def, T fallback) {
    def.fallback = std::move(fallback);
    return def;
}

/// Builds the parameters of a plugin of strobe from inputs.
class ParamBuilder {
  public:
    ParamBuilder& set(const char* name, const RgbInput& in) {
        const Rgb& c = in.constant;
        return add({name, ParamType::Rgb, {}, {c.x, c.y, c.z}, {}, {}, false, false}, in.texture);
    }
    ParamBuilder& set(const char* name, const FloatInput& in) {
        return add({name, ParamType::Float, {}, {in.constant}, {}, {}, false, false}, in.texture);
    }
    const ParamSet& params() {
        m_params.bindTextures(m_textures);
        return m_params;
    }

  private:
    ParamBuilder& add(Param p, const TexturePtr& texture) {
        if (texture) {
            const int index = int(m_textures->rgbs.size());
            m_textures->rgbs.push_back(texture);
            m_textures->floats.push_back(texture);
            p.type = ParamType::Texture;
            p.ints = {index, index};
            p.strings = {""};
        }
        m_params.add(std::move(p));
        return *this;
    }
    ParamSet m_params;
    std::shared_ptr<TextureTable> m_textures = std::make_shared<TextureTable>();
};

MaterialPtr matte(const RgbInput& kd, const BuildContext& context) {
    return mattePlugin().create(ParamBuilder().set("Kd", kd).params(), context);
}

/// Returns the inputs of a dielectric: a diffuse base of `color` below a glossy coat.
MetallicRoughnessInputs dielectric(const RgbInput& color, const Roughness& roughness) {
    MetallicRoughnessInputs in;
    in.baseColor = color;
    in.metallic = 0.f;
    in.roughness = roughness.u;
    in.vRoughness = roughness.v;
    return in;
}

/// Multiplies the gloss, that of an index of refraction of 1.5, by `ks`.
void scaleGloss(MetallicRoughnessInputs& in, const RgbInput& ks) {
    in.specular = toGray(ks, maxComponent);
    in.specularColor = mapped(ks, [](const Rgb& c) { return c / std::max(maxComponent(c), 1e-6f); });
}

MaterialPtr metal(const RgbInput& reflectance, const Roughness& roughness) {
    MetallicRoughnessInputs in;
    in.baseColor = reflectance;
    in.metallic = 1.f;
    in.roughness = roughness.u;
    in.vRoughness = roughness.v;
    return makeMetallicRoughness(in);
}

/// Returns a glass whose alpha is the square of `roughness`.
MaterialPtr glass(const RgbInput& kr, const RgbInput& kt, const FloatInput& eta, const FloatInput& roughness,
                  const BuildContext& context) {
    GlassInputs in;
    in.kr = kr;
    in.kt = kt;
    in.index = eta;
    in.uRoughness = in.vRoughness = mapped(roughness, [](float r) { return sqr(r); });
    in.scalesRadiance = context.conventions != Conventions::PbrtV2;
    return makeGlass(in);
}

/// Returns the reflectance of a conductor at normal incidence, from "reflectance" or from eta and k.
RgbInput conductorColor(const ParamSet& params, const ParamDef<RgbInput>& reflectance,
                        const ParamDef<Rgb>& eta, const ParamDef<Rgb>& k) {
    if (params.has(reflectance))
        return params.get(reflectance);
    return conductorReflectance(params.get(eta), params.get(k));
}

MaterialPtr createConductor(const ParamSet& params, const BuildContext&) {
    return metal(conductorColor(params, kReflectance, kMetalEta, kMetalK),
                 readRoughness(params, roughnessDefs(0), RoughnessRule::SquareRoot));
}

MaterialPtr createMetal(const ParamSet& params, const BuildContext& context) {
    return metal(conductorReflectance(params.get(kMetalEta), params.get(kMetalK)),
                 readRoughness(params, roughnessDefs(.01f), roughnessRule(context)));
}

MaterialPtr createCoatedDiffuse(const ParamSet& params, const BuildContext&) {
    const FloatInput eta = readIndex(params, kEta);
    MetallicRoughnessInputs in =
        dielectric(belowCoat(params.get(kReflectance), std::max(eta.constant, 1.f)),
                   readRoughness(params, roughnessDefs(0), RoughnessRule::SquareRoot));
    in.ior = eta;
    in.bodyBelowBoundary = true;
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kCoatedReflectance{"reflectance", Rgb(.5f), "reflectance of the conductor"};
const ParamDef<Rgb> kCoatedEta{"conductor.eta", kMetalEta.fallback, "index of refraction"};
const ParamDef<Rgb> kCoatedK{"conductor.k", kMetalK.fallback, "absorption coefficient"};
const RoughnessDefs kCoatedRoughness{{"conductor.roughness", 0.f, "roughness of the conductor"},
                                     {"conductor.uroughness", 0.f, "along u"},
                                     {"conductor.vroughness", 0.f, "along v"}};
const RoughnessDefs kCoatRoughness{{"interface.roughness", 0.f, "roughness of the coat"},
                                   {"interface.uroughness", 0.f, "along u"},
                                   {"interface.vroughness", 0.f, "along v"}};

MaterialPtr createCoatedConductor(const ParamSet& params, const BuildContext&) {
    constexpr float kEtaOfCoat = 1.5f; // that of the clearcoat of "metallicroughness"
    MetallicRoughnessInputs in;
    const Roughness roughness = readRoughness(params, kCoatedRoughness, RoughnessRule::SquareRoot);
    in.roughness = roughness.u;
    in.vRoughness = roughness.v;
    const RgbInput color = params.has(kCoatedReflectance)
                               ? params.get(kCoatedReflectance)
                               : RgbInput(conductorReflectance(params.get(kCoatedEta) / kEtaOfCoat,
                                                               params.get(kCoatedK) / kEtaOfCoat));
    in.baseColor = conductorBelowCoat(color, kEtaOfCoat, sqr(roughness.mean().constant));
    in.metallic = 1.f;
    in.clearcoat = 1.f;
    in.clearcoatRoughness = readRoughness(params, kCoatRoughness, RoughnessRule::SquareRoot).mean();
    return makeMetallicRoughness(in);
}

MaterialPtr createPlastic(const ParamSet& params, const BuildContext& context) {
    const FloatInput roughness = readRoughness(params, roughnessDefs(.1f), roughnessRule(context)).mean();
    return makePlasticV3(params.get(kKd), params.get(kKs), mapped(roughness, [](float r) { return r * r; }));
}

/// Ashikhmin and Shirley's model: Ks is the glossy reflectance at normal incidence, which Schlick's
/// approximation increases towards grazing angles.
MaterialPtr createSubstrate(const ParamSet& params, const BuildContext& context) {
    RoughnessDefs defs = roughnessDefs(.1f);
    defs.u.fallback = defs.v.fallback = .1f;
    MetallicRoughnessInputs in = dielectric(params.get(withDefault(kKd, RgbInput(Rgb(.5f)))),
                                            readRoughness(params, defs, roughnessRule(context)));
    in.specularColor = mapped(params.get(withDefault(kKs, RgbInput(Rgb(.5f)))),
                              [](const Rgb& c) { return c / .04f; }); // .04: reflectance of an index of 1.5
    return makeMetallicRoughness(in);
}

const ParamDef<FloatInput> kBlinnRoughness{"roughness", .1f, "the Blinn exponent is 1/roughness"};

/// Glass if the mean of Kt is above those of Kd and Ks, else a dielectric whose gloss is the larger of Ks and
/// Kr. Opacity becomes the alpha of the shapes: see BuiltMaterial.
MaterialPtr createUber(const ParamSet& params, const BuildContext& context) {
    const RgbInput kd = params.get(kKd), ks = params.get(kKs), kr = params.get(kKr), kt = params.get(kKt);
    const Roughness roughness = readRoughness(params, roughnessDefs(.1f), roughnessRule(context));
    const FloatInput eta = readIndex(params, kEta);
    if (meanOf(kt) > std::max(meanOf(kd), meanOf(ks)))
        return glass(kr, kt, eta, 0.f, context);
    const bool isMirror = meanOf(kr) > meanOf(ks);               // both lobes have the same Fresnel term
    if (context.conventions == Conventions::PbrtV2 && !isMirror) // its lobes are those of pbrt-v2's plastic
        return plasticPlugin().create(
            ParamBuilder().set("Kd", kd).set("Ks", ks).set("roughness", params.get(kBlinnRoughness)).params(),
            context);
    MetallicRoughnessInputs in = dielectric(kd, isMirror ? Roughness(0.f) : roughness);
    in.ior = eta;
    scaleGloss(in, isMirror ? kr : ks);
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kColor{"color", Rgb(.5f), "base color"};
const ParamDef<FloatInput> kMetallic{"metallic", 0.f, "0: dielectric, 1: metal"};
const ParamDef<FloatInput> kDisneyRoughness{"roughness", .5f, "its square is alpha"};
const ParamDef<FloatInput> kClearcoat{"clearcoat", 0.f, "weight of the coat"};
const ParamDef<FloatInput> kClearcoatGloss{"clearcoatgloss", 1.f, "gloss of the coat; 1: smooth"};
const ParamDef<FloatInput> kSpecTrans{"spectrans", 0.f, "weight of transmission"};
const ParamDef<bool> kThin{"thin", false, "whether the surface is a thin wall"};

MaterialPtr createDisney(const ParamSet& params, const BuildContext& context) {
    const FloatInput transmission = params.get(kSpecTrans);
    const FloatInput eta = readIndex(params, kEta);
    const bool isThin = params.get(kThin);
    const RgbInput color = params.get(kColor);
    MetallicRoughnessInputs in = dielectric(color, params.get(kDisneyRoughness));
    in.metallic = params.get(kMetallic);
    in.ior = eta;
    in.clearcoat = mapped(params.get(kClearcoat),
                          [](float c) { return c / 4; }); // Disney's coat has a weight of at most 1/4
    in.clearcoatRoughness = mapped(params.get(kClearcoatGloss), [](float gloss) {
        return std::sqrt(lerp(.1f, .001f, gloss)); // the square root of Disney's alpha
    });
    if (!isThin && meanOf(transmission) > .5f)
        return glass(Rgb(1), color, eta, in.roughness, context);
    if (isThin)
        in.transmission = transmission;
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kReflect{"reflect", Rgb(.5f), "fraction of Kd that is reflected"};
const ParamDef<RgbInput> kTransmit{"transmit", Rgb(.5f), "fraction of Kd that is transmitted"};

/// Both lobes of the v3 material are those of Kd; its gloss is left out.
MaterialPtr createTranslucent(const ParamSet& params, const BuildContext&) {
    const auto product = [](const Rgb& a, const Rgb& b) { return a * b; };
    const RgbInput kd = params.get(kKd);
    return makeDiffuseTransmission(combined(kd, params.get(kReflect), product),
                                   combined(kd, params.get(kTransmit), product));
}

MaterialPtr createThinDielectric(const ParamSet& params, const BuildContext&) {
    MetallicRoughnessInputs in = dielectric(Rgb(1), FloatInput(0));
    in.ior = readIndex(params, kEta);
    in.transmission = 1.f;
    return makeMetallicRoughness(in);
}

MaterialPtr createShinyMetal(const ParamSet& params, const BuildContext& context) {
    const RgbInput ks = params.get(withDefault(kKs, RgbInput(Rgb(1)))),
                   kr = params.get(withDefault(kKr, RgbInput(Rgb(1))));
    const Roughness roughness = readRoughness(params, roughnessDefs(.1f), roughnessRule(context));
    if (meanOf(kr) >= meanOf(ks))
        return mirrorPlugin().create(ParamBuilder().set("Kr", kr).params(), context);
    return metal(ks, roughness);
}

MaterialPtr createKdSubsurface(const ParamSet& params, const BuildContext& context) {
    MetallicRoughnessInputs in = dielectric(params.get(withDefault(kKd, RgbInput(Rgb(.5f)))),
                                            readRoughness(params, roughnessDefs(0), roughnessRule(context)));
    in.ior = readIndex(params, withDefault(kEta, FloatInput(1.33f)));
    return makeMetallicRoughness(in);
}

const ParamDef<Rgb> kSigmaA{"sigma_a", Rgb(.0011f, .0024f, .014f), "absorption coefficient"};
const ParamDef<Rgb> kSigmaS{"sigma_s", Rgb(2.55f, 3.21f, 3.77f), "scattering coefficient", "sigma_prime_s"};
const ParamDef<float> kG{"g", 0.f, "mean cosine of the phase function"};

/// Returns the diffuse reflectance of a semi-infinite slab (Jensen et al., "A Practical Model for Subsurface
/// Light Transport", 2001), without internal reflection at the boundary.
Rgb slabReflectance(const Rgb& sigmaA, const Rgb& sigmaS) {
    Rgb r;
    for (int i = 0; i < 3; ++i) {
        const float albedo = sigmaS[i] / std::max(sigmaS[i] + sigmaA[i], 1e-12f);
        const float root = std::sqrt(3 * (1 - albedo));
        r[i] = albedo / 2 * (1 + std::exp(-4.f / 3 * root)) * std::exp(-root);
    }
    return r;
}

MaterialPtr createSubsurface(const ParamSet& params, const BuildContext& context) {
    const Rgb scattering = params.get(kSigmaS) * (1 - params.get(kG));
    const RgbInput color = params.has(kReflectance)
                               ? params.get(kReflectance)
                               : RgbInput(slabReflectance(params.get(kSigmaA), scattering));
    MetallicRoughnessInputs in =
        dielectric(color, readRoughness(params, roughnessDefs(0), roughnessRule(context)));
    in.ior = readIndex(params, withDefault(kEta, FloatInput(1.33f)));
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kHairColor{"color", Rgb(.5f), "color of the hair", "reflectance"};
const ParamDef<Rgb> kHairSigma{"sigma_a", Rgb(0), "absorption coefficient"};
const ParamDef<float> kEumelanin{"eumelanin", 0.f, "concentration of brown pigment"};
const ParamDef<float> kPheomelanin{"pheomelanin", 0.f, "concentration of red pigment"};
const ParamDef<float> kBetaN{"beta_n", .3f, "azimuthal roughness"};

/// The color of many hairs follows from the absorption coefficient of one (Chiang et al., "A Practical and
/// Controllable Hair and Fur Model for Production Path Tracing", 2016); absorption of melanins from d'Eon et
/// al., 2011.
MaterialPtr createHair(const ParamSet& params, const BuildContext& context) {
    if (params.has(kHairColor))
        return matte(params.get(kHairColor), context);
    Rgb sigma = params.get(kHairSigma);
    if (!params.has(kHairSigma)) {
        const bool hasMelanin = params.has(kEumelanin) || params.has(kPheomelanin);
        sigma = Rgb(.419f, .697f, 1.37f) * (hasMelanin ? params.get(kEumelanin) : 1.3f) +
                Rgb(.187f, .4f, 1.05f) * params.get(kPheomelanin);
    }
    const float b = params.get(kBetaN);
    const float density = 5.969f + b * (-.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * .245f))));
    Rgb color;
    for (int i = 0; i < 3; ++i)
        color[i] = std::exp(-std::sqrt(std::max(sigma[i], 0.f)) * density);
    return matte(color, context);
}

/// Replaces materials of measured data.
MaterialPtr createGray(const ParamSet& params, const BuildContext& context) {
    params.markAllUsed();
    return matte(Rgb(.5f), context);
}

} // namespace

std::shared_ptr<const Material> makeDenseMedium(const Rgb& absorption, const Rgb& scattering) {
    return makeMetallicRoughness(dielectric(slabReflectance(absorption, scattering), Roughness(0.f)));
}

std::vector<CompatPlugin<MaterialRow>> compatMaterials() {
    const std::string gloss = "\"metallicroughness\" is used instead";
    const std::string gray = "a gray \"matte\" is used instead";
    const std::string diffuse = "\"diffusetransmission\" is used instead; its gloss is ignored";
    const ParamDef<FloatInput> roughness = roughnessDefs(0).both;
    const ParamDef<bool> remap = roughnessDefs(0).remap;
    return {
        {{"conductor",
          "",
          {kMetalEta, kMetalK, kReflectance, roughness, kURoughness, kVRoughness, remap},
          createConductor},
         gloss},
        {{"metal", "", {kMetalEta, kMetalK, roughness, kURoughness, kVRoughness, remap}, createMetal}, gloss},
        {{"plastic", "", {kKd, kKs, roughness, remap}, createPlastic}, ""},
        {{"coateddiffuse",
          "",
          {kReflectance, kEta, roughness, kURoughness, kVRoughness, remap},
          createCoatedDiffuse},
         gloss},
        {{"coatedconductor",
          "",
          {kCoatedReflectance, kCoatedEta, kCoatedK, kCoatedRoughness.both, kCoatedRoughness.u,
           kCoatedRoughness.v, kCoatRoughness.both, kCoatRoughness.u, kCoatRoughness.v, remap},
          createCoatedConductor},
         gloss},
        {{"substrate", "", {kKd, kKs, roughness, kURoughness, kVRoughness, remap}, createSubstrate}, gloss},
        {{"uber", "", {kKd, kKs, kKr, kKt, kEta, roughness, kURoughness, kVRoughness, remap}, createUber},
         "its largest lobes are rendered as \"plastic\" (pbrt-v2), \"metallicroughness\" or \"glass\""},
        {{"disney",
          "",
          {kColor, kMetallic, kEta, kDisneyRoughness, kClearcoat, kClearcoatGloss, kSpecTrans, kThin},
          createDisney},
         gloss},
        {{"shinymetal", "", {kKs, kKr, roughness, kURoughness, kVRoughness, remap}, createShinyMetal},
         "\"mirror\" or \"metallicroughness\" is used instead"},
        {{"thindielectric", "", {kEta}, createThinDielectric}, gloss},
        {{"translucent", "", {kKd, kReflect, kTransmit}, createTranslucent}, diffuse},
        {{"kdsubsurface", "", {kKd, kEta, roughness, kURoughness, kVRoughness, remap}, createKdSubsurface},
         gloss},
        {{"subsurface",
          "",
          {kReflectance, kSigmaA, kSigmaS, kG, kEta, roughness, kURoughness, kVRoughness, remap},
          createSubsurface},
         gloss},
        {{"hair", "", {kHairColor, kHairSigma, kEumelanin, kPheomelanin, kBetaN}, createHair},
         "\"matte\" is used instead"},
        {{"fourier", "", {}, createGray}, gray},
        {{"measured", "", {}, createGray}, gray},
    };
}

} // namespace strobe
