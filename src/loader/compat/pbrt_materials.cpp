#include "loader/compat/pbrt_compat.h"

#include "loader/compat/pbrt_inputs.h"
#include "materials/glass.h"
#include "materials/matte.h"
#include "materials/metallic_roughness.h"
#include "materials/plastic.h"

namespace strobe {
namespace {

using MaterialPtr = std::shared_ptr<const Material>;

// Parameters of several materials. Defaults that differ are given where they are read.
const ParamDef<RgbInput> kKd{"Kd", Rgb(.25f), "diffuse reflectance"};
const ParamDef<RgbInput> kKs{"Ks", Rgb(.25f), "factor of the gloss"};
const ParamDef<RgbInput> kKr{"Kr", Rgb(0), "factor of the mirror"};
const ParamDef<RgbInput> kKt{"Kt", Rgb(0), "factor of what goes through"};
const ParamDef<RgbInput> kReflectance{"reflectance", Rgb(.5f), "reflectance"};
const ParamDef<FloatInput> kEta{"eta", 1.5f, "index of refraction", "index"};
const ParamDef<FloatInput> kURoughness{"uroughness", 0.f, "roughness along u"};
const ParamDef<FloatInput> kVRoughness{"vroughness", 0.f, "roughness along v"};
const ParamDef<Rgb> kMetalEta{"eta", Rgb(.20042f, .92405f, 1.10221f), "index of refraction"};
const ParamDef<Rgb> kMetalK{"k", Rgb(3.91294f, 2.45284f, 2.14219f), "absorption coefficient"};

RoughnessDefs roughnessOf(float fallback) {
    return {{"roughness", fallback, "roughness"}, kURoughness, kVRoughness};
}

RoughnessRule ruleOf(const BuildContext& context) {
    return context.conventions == Conventions::PbrtV2 ? RoughnessRule::BlinnExponent
                                                      : RoughnessRule::Polynomial;
}

template <class T>
ParamDef<T> with(ParamDef<T> def, T fallback) {
    def.fallback = std::move(fallback);
    return def;
}

/// A parameter for one of our plugins.
class OurParams {
  public:
    OurParams& set(const char* name, const RgbInput& in) {
        Param p{name, ParamType::Rgb, {},   {in.constant.x, in.constant.y, in.constant.z}, {},
                {},   false,          false};
        return add(std::move(p), in.texture);
    }
    OurParams& set(const char* name, const FloatInput& in) {
        return add({name, ParamType::Float, {}, {in.constant}, {}, {}, false, false}, in.texture);
    }
    const ParamSet& params() {
        m_params.bindTextures(m_textures);
        return m_params;
    }

  private:
    OurParams& add(Param p, const TexturePtr& texture) {
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
    return mattePlugin().create(OurParams().set("Kd", kd).params(), context);
}

/// A colored body under a gloss, none of which is metal.
MetallicRoughnessInputs body(const RgbInput& color, const FloatInput& roughness) {
    MetallicRoughnessInputs in;
    in.baseColor = color;
    in.metallic = 0.f;
    in.roughness = roughness;
    return in;
}

/// The gloss of an index of 1.5 times `ks`.
void scaleGloss(MetallicRoughnessInputs& in, const RgbInput& ks) {
    in.specular = grayOf(ks, maxComponent);
    in.specularColor = mapped(ks, [](const Rgb& c) { return c / std::max(maxComponent(c), 1e-6f); });
}

MaterialPtr metal(const RgbInput& reflectance, const FloatInput& roughness) {
    MetallicRoughnessInputs in;
    in.baseColor = reflectance;
    in.metallic = 1.f;
    in.roughness = roughness;
    return makeMetallicRoughness(in);
}

/// A conductor's color: "reflectance", or from eta and k, each behind the prefix that is in their names.
RgbInput conductorColor(const ParamSet& params, const ParamDef<RgbInput>& reflectance,
                        const ParamDef<Rgb>& eta, const ParamDef<Rgb>& k) {
    if (params.has(reflectance))
        return params.get(reflectance);
    return conductorReflectance(params.get(eta), params.get(k));
}

MaterialPtr createConductor(const ParamSet& params, const BuildContext&) {
    return metal(conductorColor(params, kReflectance, kMetalEta, kMetalK),
                 readRoughness(params, roughnessOf(0), RoughnessRule::SquareRoot));
}

MaterialPtr createMetal(const ParamSet& params, const BuildContext& context) {
    return metal(conductorReflectance(params.get(kMetalEta), params.get(kMetalK)),
                 readRoughness(params, roughnessOf(.01f), ruleOf(context)));
}

MaterialPtr createCoatedDiffuse(const ParamSet& params, const BuildContext&) {
    MetallicRoughnessInputs in =
        body(params.get(kReflectance), readRoughness(params, roughnessOf(0), RoughnessRule::SquareRoot));
    in.ior = readIndex(params, kEta);
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kCoatedReflectance{"reflectance", Rgb(.5f), "of the conductor"};
const ParamDef<Rgb> kCoatedEta{"conductor.eta", kMetalEta.fallback, "index of refraction"};
const ParamDef<Rgb> kCoatedK{"conductor.k", kMetalK.fallback, "absorption coefficient"};
const RoughnessDefs kCoatedRoughness{{"conductor.roughness", 0.f, "roughness of the conductor"},
                                     {"conductor.uroughness", 0.f, "along u"},
                                     {"conductor.vroughness", 0.f, "along v"}};
const RoughnessDefs kCoatRoughness{{"interface.roughness", 0.f, "roughness of the coat"},
                                   {"interface.uroughness", 0.f, "along u"},
                                   {"interface.vroughness", 0.f, "along v"}};

MaterialPtr createCoatedConductor(const ParamSet& params, const BuildContext&) {
    MetallicRoughnessInputs in;
    in.baseColor = conductorColor(params, kCoatedReflectance, kCoatedEta, kCoatedK);
    in.metallic = 1.f;
    in.roughness = readRoughness(params, kCoatedRoughness, RoughnessRule::SquareRoot);
    in.clearcoat = 1.f;
    in.clearcoatRoughness = readRoughness(params, kCoatRoughness, RoughnessRule::SquareRoot);
    return makeMetallicRoughness(in);
}

MaterialPtr createPlastic(const ParamSet& params, const BuildContext& context) {
    MetallicRoughnessInputs in =
        body(params.get(kKd), readRoughness(params, roughnessOf(.1f), ruleOf(context)));
    scaleGloss(in, params.get(kKs));
    return makeMetallicRoughness(in);
}

/// Ashikhmin and Shirley's: Ks is the gloss at normal incidence itself, and it grows by Schlick's rule.
MaterialPtr createSubstrate(const ParamSet& params, const BuildContext& context) {
    RoughnessDefs defs = roughnessOf(.1f);
    defs.u.fallback = defs.v.fallback = .1f;
    MetallicRoughnessInputs in =
        body(params.get(with(kKd, RgbInput(Rgb(.5f)))), readRoughness(params, defs, ruleOf(context)));
    in.specularColor = mapped(params.get(with(kKs, RgbInput(Rgb(.5f)))),
                              [](const Rgb& c) { return c / .04f; }); // of the index of 1.5
    return makeMetallicRoughness(in);
}

const ParamDef<FloatInput> kBlinnRoughness{"roughness", .1f, "the Blinn exponent is 1/roughness"};

/// The heaviest of uber's four lobes says which material it is; its opacity is dealt with where its shapes
/// are.
MaterialPtr createUber(const ParamSet& params, const BuildContext& context) {
    const RgbInput kd = params.get(kKd), ks = params.get(kKs), kr = params.get(kKr), kt = params.get(kKt);
    const FloatInput roughness = readRoughness(params, roughnessOf(.1f), ruleOf(context)),
                     eta = readIndex(params, kEta);
    if (meanOf(kt) > std::max(meanOf(kd), meanOf(ks)))
        return glassPlugin().create(OurParams().set("Kr", kr).set("Kt", kt).set("index", eta).params(),
                                    context);
    const bool isMirror = meanOf(kr) > meanOf(ks);               // both under Fresnel's factor
    if (context.conventions == Conventions::PbrtV2 && !isMirror) // the very lobes of pbrt-v2's plastic
        return plasticPlugin().create(
            OurParams().set("Kd", kd).set("Ks", ks).set("roughness", params.get(kBlinnRoughness)).params(),
            context);
    MetallicRoughnessInputs in = body(kd, isMirror ? FloatInput(0) : roughness);
    in.ior = eta;
    scaleGloss(in, isMirror ? kr : ks);
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kColor{"color", Rgb(.5f), "base color"};
const ParamDef<FloatInput> kMetallic{"metallic", 0.f, "0: dielectric, 1: metal"};
const ParamDef<FloatInput> kDisneyRoughness{"roughness", .5f, "its square is alpha"};
const ParamDef<FloatInput> kClearcoat{"clearcoat", 0.f, "strength of the coat"};
const ParamDef<FloatInput> kClearcoatGloss{"clearcoatgloss", 1.f, "1: smooth"};
const ParamDef<FloatInput> kSpecTrans{"spectrans", 0.f, "how much goes through"};
const ParamDef<bool> kThin{"thin", false, "a thin wall"};

MaterialPtr createDisney(const ParamSet& params, const BuildContext& context) {
    const FloatInput through = params.get(kSpecTrans), eta = readIndex(params, kEta);
    const bool isThin = params.get(kThin);
    const RgbInput color = params.get(kColor);
    MetallicRoughnessInputs in = body(color, params.get(kDisneyRoughness));
    in.metallic = params.get(kMetallic);
    in.ior = eta;
    in.clearcoat = mapped(params.get(kClearcoat), [](float c) { return c / 4; }); // Disney's coat at its most
    in.clearcoatRoughness = mapped(params.get(kClearcoatGloss), [](float gloss) {
        return std::sqrt(lerp(.1f, .001f, gloss)); // Disney's alpha
    });
    if (!isThin && meanOf(through) > .5f)
        return glassPlugin().create(OurParams().set("Kt", color).set("index", eta).params(), context);
    if (isThin)
        in.transmission = through;
    return makeMetallicRoughness(in);
}

Rgb sumBelowOne(const Rgb& a, const Rgb& b) {
    const Rgb sum = a + b;
    return sum / std::max(1.f, maxComponent(sum));
}

const ParamDef<RgbInput> kReflect{"reflect", Rgb(.5f), "share of Kd that is reflected"};
const ParamDef<RgbInput> kTransmit{"transmit", Rgb(.5f), "share of Kd that goes through"};

/// What would go through is reflected: as bright, lit from both sides.
MaterialPtr createTranslucent(const ParamSet& params, const BuildContext& context) {
    const RgbInput share = combined(params.get(kReflect), params.get(kTransmit), sumBelowOne);
    return matte(combined(params.get(kKd), share, [](const Rgb& a, const Rgb& b) { return a * b; }), context);
}

const ParamDef<RgbInput> kTransmittance{"transmittance", Rgb(.25f), "what goes through"};
const ParamDef<float> kScale{"scale", 1.f, "factor of both"};

MaterialPtr createDiffuseTransmission(const ParamSet& params, const BuildContext& context) {
    const float scale = params.get(kScale);
    const RgbInput sum =
        combined(params.get(with(kReflectance, RgbInput(Rgb(.25f)))), params.get(kTransmittance),
                 [scale](const Rgb& a, const Rgb& b) { return sumBelowOne(a * scale, b * scale); });
    return matte(sum, context);
}

MaterialPtr createThinDielectric(const ParamSet& params, const BuildContext&) {
    MetallicRoughnessInputs in = body(Rgb(1), FloatInput(0));
    in.ior = readIndex(params, kEta);
    in.transmission = 1.f;
    return makeMetallicRoughness(in);
}

MaterialPtr createShinyMetal(const ParamSet& params, const BuildContext& context) {
    const RgbInput ks = params.get(with(kKs, RgbInput(Rgb(1)))), kr = params.get(with(kKr, RgbInput(Rgb(1))));
    const FloatInput roughness = readRoughness(params, roughnessOf(.1f), ruleOf(context));
    const bool isMirror = meanOf(kr) > meanOf(ks);
    return metal(isMirror ? kr : ks, isMirror ? FloatInput(0) : roughness);
}

MaterialPtr createKdSubsurface(const ParamSet& params, const BuildContext& context) {
    MetallicRoughnessInputs in = body(params.get(with(kKd, RgbInput(Rgb(.5f)))),
                                      readRoughness(params, roughnessOf(0), ruleOf(context)));
    in.ior = readIndex(params, with(kEta, FloatInput(1.33f)));
    return makeMetallicRoughness(in);
}

const ParamDef<Rgb> kSigmaA{"sigma_a", Rgb(.0011f, .0024f, .014f), "absorption"};
const ParamDef<Rgb> kSigmaS{"sigma_s", Rgb(2.55f, 3.21f, 3.77f), "scattering", "sigma_prime_s"};
const ParamDef<float> kG{"g", 0.f, "mean cosine of the scattering"};

/// Diffuse reflectance of a deep slab (Jensen et al., "A Practical Model for Subsurface Light Transport",
/// 2001), without the part that its boundary reflects back inside.
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
    MetallicRoughnessInputs in = body(color, readRoughness(params, roughnessOf(0), ruleOf(context)));
    in.ior = readIndex(params, with(kEta, FloatInput(1.33f)));
    return makeMetallicRoughness(in);
}

const ParamDef<RgbInput> kHairColor{"color", Rgb(.5f), "color of the hair", "reflectance"};
const ParamDef<Rgb> kHairSigma{"sigma_a", Rgb(0), "absorption"};
const ParamDef<float> kEumelanin{"eumelanin", 0.f, "concentration of brown pigment"};
const ParamDef<float> kPheomelanin{"pheomelanin", 0.f, "concentration of red pigment"};
const ParamDef<float> kBetaN{"beta_n", .3f, "azimuthal roughness"};

/// The color of many hairs, from the absorption in one (Chiang et al., "A Practical and Controllable Hair
/// and Fur Model for Production Path Tracing", 2016); melanins as in d'Eon et al., 2011.
MaterialPtr createHair(const ParamSet& params, const BuildContext& context) {
    if (params.has(kHairColor))
        return matte(params.get(kHairColor), context);
    Rgb sigma = params.get(kHairSigma);
    if (!params.has(kHairSigma)) {
        const bool isGiven = params.has(kEumelanin) || params.has(kPheomelanin);
        sigma = Rgb(.419f, .697f, 1.37f) * (isGiven ? params.get(kEumelanin) : 1.3f) +
                Rgb(.187f, .4f, 1.05f) * params.get(kPheomelanin);
    }
    const float b = params.get(kBetaN);
    const float density = 5.969f + b * (-.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * .245f))));
    Rgb color;
    for (int i = 0; i < 3; ++i)
        color[i] = std::exp(-std::sqrt(std::max(sigma[i], 0.f)) * density);
    return matte(color, context);
}

MaterialPtr createGray(const ParamSet& params, const BuildContext& context) {
    params.markAllUsed(); // of measurements that are not read
    return matte(Rgb(.5f), context);
}

} // namespace

std::vector<CompatPlugin<MaterialRow>> compatMaterials() {
    const std::string gloss = "\"metallicroughness\" takes its place",
                      gray = "a gray \"matte\" takes its place";
    const std::string diffuse = "\"matte\" takes its place, reflecting what would go through";
    const ParamDef<FloatInput> roughness = roughnessOf(0).both;
    const ParamDef<bool> remap = roughnessOf(0).remap;
    return {
        {{"conductor",
          "",
          {kMetalEta, kMetalK, kReflectance, roughness, kURoughness, kVRoughness, remap},
          createConductor},
         gloss},
        {{"metal", "", {kMetalEta, kMetalK, roughness, kURoughness, kVRoughness, remap}, createMetal}, gloss},
        {{"plastic", "", {kKd, kKs, roughness, kURoughness, kVRoughness, remap}, createPlastic}, gloss},
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
         "its heaviest lobes take its place, as \"plastic\" (pbrt-v2), \"metallicroughness\" or \"glass\""},
        {{"disney",
          "",
          {kColor, kMetallic, kEta, kDisneyRoughness, kClearcoat, kClearcoatGloss, kSpecTrans, kThin},
          createDisney},
         gloss},
        {{"shinymetal", "", {kKs, kKr, roughness, kURoughness, kVRoughness, remap}, createShinyMetal}, gloss},
        {{"thindielectric", "", {kEta}, createThinDielectric}, gloss},
        {{"translucent", "", {kKd, kReflect, kTransmit}, createTranslucent}, diffuse},
        {{"diffusetransmission", "", {kReflectance, kTransmittance, kScale}, createDiffuseTransmission},
         diffuse},
        {{"kdsubsurface", "", {kKd, kEta, roughness, kURoughness, kVRoughness, remap}, createKdSubsurface},
         gloss},
        {{"subsurface",
          "",
          {kReflectance, kSigmaA, kSigmaS, kG, kEta, roughness, kURoughness, kVRoughness, remap},
          createSubsurface},
         gloss},
        {{"hair", "", {kHairColor, kHairSigma, kEumelanin, kPheomelanin, kBetaN}, createHair},
         "\"matte\" takes its place"},
        {{"fourier", "", {}, createGray}, gray},
        {{"measured", "", {}, createGray}, gray},
    };
}

} // namespace strobe
