#include "gltf/material.h"

#include "gltf/material_reader.h"
#include "materials/glass.h"
#include "materials/mix.h"

#include <algorithm>

namespace strobe::gltf {
namespace {

/// Returns an extension of a material; null: the material lacks it.
const tinygltf::Value* extension(const tinygltf::Material& material, const char* name) {
    const auto it = material.extensions.find(name);
    return it == material.extensions.end() ? nullptr : &it->second;
}

/// 1 if alpha is at least the cutoff, else 0.
class Cutout : public Texture {
  public:
    Cutout(FloatInput alpha, float cutoff) : m_alpha(std::move(alpha)), m_cutoff(cutoff) {}
    Rgb rgb(const TextureQuery& q) const override { return Rgb(m_alpha.at(q) >= m_cutoff ? 1.f : 0.f); }

  private:
    FloatInput m_alpha;
    float m_cutoff;
};

} // namespace

struct MaterialBuilder::Source {
    std::string name, jsonPath;
    Rgb base{1}, emissive{0}, specularColor{1};
    float opacity = 1, metallic = 1, roughness = 1, ior = 1.5f, specular = 1, transmission = 0, clearcoat = 0,
          clearcoatRoughness = 0, normalScale = 1, cutoff = .5f, clearcoatNormalScale = 1, sheenRoughness = 0,
          anisotropy = 0, anisotropyRotation = 0, iridescence = 0, iridescenceIor = 1.3f, filmMin = 100,
          filmMax = 400, thickness = 0, attenuationDistance = kInfinity;
    Rgb sheenColor{0}, attenuationColor{1};
    TextureSlot clearcoatNormalSlot, sheenColorSlot, sheenRoughnessSlot, anisotropySlot, iridescenceSlot,
        filmSlot;
    TextureSlot baseSlot, packedSlot, normalSlot, emissiveSlot, specularSlot, specularColorSlot,
        transmissionSlot, clearcoatSlot, clearcoatRoughnessSlot;
    enum { Opaque, Mask, Blend } alphaMode = Opaque;
    bool unlit = false, doubleSided = false;

    std::vector<const TextureSlot*> slots() const {
        std::vector<const TextureSlot*> used;
        for (const TextureSlot* slot :
             {&baseSlot, &packedSlot, &normalSlot, &emissiveSlot, &specularSlot, &specularColorSlot,
              &transmissionSlot, &clearcoatSlot, &clearcoatRoughnessSlot, &clearcoatNormalSlot,
              &sheenColorSlot, &sheenRoughnessSlot, &anisotropySlot, &iridescenceSlot, &filmSlot})
            if (*slot)
                used.push_back(slot);
        return used;
    }
    /// The set of texture coordinates of the first texture; the mesh's uvs.
    int mainUvSet() const { return slots().empty() ? 0 : slots().front()->texCoord; }
    bool usesSeveralUvSets() const {
        const auto used = slots();
        return std::any_of(used.begin(), used.end(),
                           [&](const TextureSlot* slot) { return slot->texCoord != mainUvSet(); });
    }
};

struct MaterialBuilder::TextureContext {
    const Primitive& primitive;
    const std::string& jsonPath;                                ///< of the material
    int mainUvSet;                                              ///< index of the TEXCOORD of the mesh's uvs
    std::shared_ptr<const VertexValues<Rgb>> colors, opacities; ///< null: none
};

std::string MaterialBuilder::nameOf(int material) const {
    return material < 0 ? "default" : m_document.model().materials[size_t(material)].name;
}

MaterialBuilder::Source MaterialBuilder::read(int index) const {
    Source s;
    s.name = nameOf(index);
    if (index < 0)
        return s;
    const tinygltf::Material& m = m_document.model().materials[size_t(index)];
    s.jsonPath = item("materials", size_t(index));
    const MaterialReader reader(m_document, s.jsonPath);
    const auto& pbr = m.pbrMetallicRoughness;
    s.base = reader.color(pbr.baseColorFactor, "pbrMetallicRoughness.baseColorFactor", 4);
    s.opacity = float(pbr.baseColorFactor[3]);
    s.metallic = float(pbr.metallicFactor);
    s.roughness = float(pbr.roughnessFactor);
    s.baseSlot = reader.slot(pbr.baseColorTexture, "pbrMetallicRoughness.baseColorTexture");
    s.packedSlot = reader.slot(pbr.metallicRoughnessTexture, "pbrMetallicRoughness.metallicRoughnessTexture");
    s.normalSlot = reader.slot(m.normalTexture, "normalTexture");
    s.normalScale = float(m.normalTexture.scale);
    if (!m.emissiveFactor.empty())
        s.emissive = reader.color(m.emissiveFactor, "emissiveFactor", 3);
    s.emissiveSlot = reader.slot(m.emissiveTexture, "emissiveTexture");
    s.doubleSided = m.doubleSided;
    s.cutoff = float(m.alphaCutoff);
    if (m.alphaMode == "MASK")
        s.alphaMode = Source::Mask;
    else if (m.alphaMode == "BLEND")
        s.alphaMode = Source::Blend;
    else if (m.alphaMode != "OPAQUE")
        m_document.fail(s.jsonPath + ".alphaMode",
                        "unknown \"" + m.alphaMode + "\" (known: OPAQUE, MASK, BLEND)");
    if (m.occlusionTexture.index >= 0)
        m_document.warnOnce(m_diagnostics, "occlusion", s.jsonPath + ".occlusionTexture",
                            "occlusion textures are ignored: occlusion is computed");
    readExtensions(m, s);
    return s;
}

void MaterialBuilder::readExtensions(const tinygltf::Material& m, Source& s) const {
    const MaterialReader reader(m_document, s.jsonPath);
    s.unlit = extension(m, "KHR_materials_unlit") != nullptr;
    if (const auto* e = extension(m, "KHR_materials_emissive_strength"))
        s.emissive *= std::max(reader.number(*e, "emissiveStrength", 1), 0.f);
    if (const auto* e = extension(m, "KHR_materials_ior"))
        s.ior = reader.number(*e, "ior", 1.5f);
    if (const auto* e = extension(m, "KHR_materials_specular")) {
        s.specular = reader.number(*e, "specularFactor", 1);
        s.specularColor = reader.color(*e, "specularColorFactor", Rgb(1));
        s.specularSlot = reader.slot(*e, "specularTexture");
        s.specularColorSlot = reader.slot(*e, "specularColorTexture");
    }
    if (const auto* e = extension(m, "KHR_materials_transmission")) {
        s.transmission = reader.number(*e, "transmissionFactor", 0);
        s.transmissionSlot = reader.slot(*e, "transmissionTexture");
    }
    if (const auto* e = extension(m, "KHR_materials_clearcoat")) {
        s.clearcoat = reader.number(*e, "clearcoatFactor", 0);
        s.clearcoatRoughness = reader.number(*e, "clearcoatRoughnessFactor", 0);
        s.clearcoatSlot = reader.slot(*e, "clearcoatTexture");
        s.clearcoatRoughnessSlot = reader.slot(*e, "clearcoatRoughnessTexture");
        s.clearcoatNormalSlot = reader.slot(*e, "clearcoatNormalTexture");
        if (s.clearcoatNormalSlot)
            s.clearcoatNormalScale = reader.number(e->Get("clearcoatNormalTexture"), "scale", 1);
    }
    readFinish(m, s);
}

/// Reads the extensions for sheen, anisotropy, iridescence and volume.
void MaterialBuilder::readFinish(const tinygltf::Material& m, Source& s) const {
    const MaterialReader reader(m_document, s.jsonPath);
    if (const auto* e = extension(m, "KHR_materials_sheen")) {
        s.sheenColor = reader.color(*e, "sheenColorFactor", Rgb(0));
        s.sheenRoughness = reader.number(*e, "sheenRoughnessFactor", 0);
        s.sheenColorSlot = reader.slot(*e, "sheenColorTexture");
        s.sheenRoughnessSlot = reader.slot(*e, "sheenRoughnessTexture");
    }
    if (const auto* e = extension(m, "KHR_materials_anisotropy")) {
        s.anisotropy = reader.number(*e, "anisotropyStrength", 0);
        s.anisotropyRotation = reader.number(*e, "anisotropyRotation", 0);
        s.anisotropySlot = reader.slot(*e, "anisotropyTexture");
    }
    if (const auto* e = extension(m, "KHR_materials_iridescence")) {
        s.iridescence = reader.number(*e, "iridescenceFactor", 0);
        s.iridescenceIor = reader.number(*e, "iridescenceIor", 1.3f);
        s.filmMin = reader.number(*e, "iridescenceThicknessMinimum", 100);
        s.filmMax = reader.number(*e, "iridescenceThicknessMaximum", 400);
        s.iridescenceSlot = reader.slot(*e, "iridescenceTexture");
        s.filmSlot = reader.slot(*e, "iridescenceThicknessTexture");
    }
    if (const auto* e = extension(m, "KHR_materials_volume")) {
        s.thickness = reader.number(*e, "thicknessFactor", 0);
        s.attenuationDistance = reader.number(*e, "attenuationDistance", kInfinity);
        s.attenuationColor = reader.color(*e, "attenuationColor", Rgb(1));
    }
}

std::shared_ptr<ImageTexture> MaterialBuilder::texture(const TextureSlot& slot, TextureUse use,
                                                       const TextureContext& context, const Rgb& factor,
                                                       int channel) {
    std::shared_ptr<ImageTexture> out = m_images.open(slot, use, context.jsonPath);
    if (!out)
        return nullptr;
    out->factor = factor;
    out->channel = channel;
    const auto& sets = context.primitive.uvSets;
    const auto requested = sets.find(slot.texCoord);
    if (requested == sets.end())
        m_document.warnOnce(m_diagnostics, "no uvs", context.primitive.jsonPath,
                            "has no TEXCOORD_" + std::to_string(slot.texCoord) + " for the textures of " +
                                context.jsonPath);
    if (slot.texCoord != context.mainUvSet) {
        auto replacement = std::make_shared<UvReplacement>();
        replacement->indices = context.primitive.mesh.indices;
        const std::vector<V2f> zeros(context.primitive.mesh.vertexCount(), V2f(0));
        const auto main = sets.find(context.mainUvSet);
        replacement->meshUvs = main == sets.end() ? zeros : main->second;
        replacement->uvs = requested == sets.end() ? zeros : requested->second;
        out->uvs = std::move(replacement);
    }
    return out;
}

RgbInput MaterialBuilder::baseColor(const Source& s, const TextureContext& context) {
    RgbInput input(s.base);
    auto image = texture(s.baseSlot, TextureUse::Color, context, s.base);
    if (!image && context.colors) {
        image = std::make_shared<ImageTexture>();
        image->factor = s.base;
    }
    if (image)
        image->colors = context.colors;
    input.texture = image;
    return input;
}

FloatInput MaterialBuilder::alpha(const Source& s, const TextureContext& context) {
    if (s.alphaMode == Source::Opaque)
        return 1;
    FloatInput input(s.opacity);
    auto image = texture(s.baseSlot, TextureUse::Alpha, context, Rgb(s.opacity));
    if (!image && context.opacities) {
        image = std::make_shared<ImageTexture>();
        image->factor = Rgb(s.opacity);
    }
    if (image)
        image->colors = context.opacities;
    input.texture = image;
    if (s.alphaMode == Source::Blend)
        return input;
    if (!input.texture)
        return input.constant >= s.cutoff ? 1.f : 0.f;
    FloatInput cutout(1);
    cutout.texture = std::make_shared<Cutout>(std::move(input), s.cutoff);
    return cutout;
}

MetallicRoughnessInputs MaterialBuilder::inputs(const Source& s, const TextureContext& context) {
    const auto inputFrom = [&](float factor, const TextureSlot& slot, int channel) {
        FloatInput input(factor);
        input.texture = texture(slot, TextureUse::Data, context, Rgb(factor), channel);
        return input;
    };
    MetallicRoughnessInputs in;
    in.baseColor = baseColor(s, context);
    in.metallic = s.metallic;
    in.roughness = s.roughness;
    in.packed = texture(s.packedSlot, TextureUse::Data, context);
    in.ior = s.ior;
    in.specular = s.specular;
    in.specular.texture = texture(s.specularSlot, TextureUse::Alpha, context, Rgb(s.specular));
    in.specularColor = s.specularColor;
    in.specularColor.texture = texture(s.specularColorSlot, TextureUse::Color, context, s.specularColor);
    in.transmission = inputFrom(s.transmission, s.transmissionSlot, 0);
    in.clearcoat = inputFrom(s.clearcoat, s.clearcoatSlot, 0);
    in.clearcoatRoughness = inputFrom(s.clearcoatRoughness, s.clearcoatRoughnessSlot, 1);
    if (const TexturePtr map = texture(s.normalSlot, TextureUse::Data, context))
        in.normals = makeNormalMap(map, s.normalScale);
    addFinish(s, context, in);
    return in;
}

void MaterialBuilder::addFinish(const Source& s, const TextureContext& context, MetallicRoughnessInputs& in) {
    in.clearcoatNormals = texture(s.clearcoatNormalSlot, TextureUse::Data, context);
    in.clearcoatNormalScale = s.clearcoatNormalScale;
    in.sheenColor = s.sheenColor;
    in.sheenColor.texture = texture(s.sheenColorSlot, TextureUse::Color, context, s.sheenColor);
    in.sheenRoughness = s.sheenRoughness;
    in.sheenRoughness.texture =
        texture(s.sheenRoughnessSlot, TextureUse::Alpha, context, Rgb(s.sheenRoughness));
    in.anisotropy = s.anisotropy;
    in.anisotropyRotation = s.anisotropyRotation;
    in.anisotropyMap = texture(s.anisotropySlot, TextureUse::Data, context);
    in.iridescence = s.iridescence;
    in.iridescence.texture = texture(s.iridescenceSlot, TextureUse::Data, context, Rgb(s.iridescence));
    in.iridescenceIor = s.iridescenceIor;
    in.iridescenceThickness = s.filmMax;
    if (const TexturePtr film = texture(s.filmSlot, TextureUse::Data, context, Rgb(1), 1))
        in.iridescenceThickness.texture =
            std::make_shared<PowerTexture>(film, 1.f, s.filmMax - s.filmMin, s.filmMin);
}

/// Returns the material of a closed surface around a dielectric. Light is tinted by the base color once on
/// its way in and out, as it is on its way through a thin wall.
std::shared_ptr<const Material> MaterialBuilder::solid(const Source& s, const TextureContext& context,
                                                       MetallicRoughnessInputs in) {
    GlassInputs glass;
    glass.index = s.ior;
    glass.scalesRadiance = false; // the camera is outside
    glass.kt = Rgb(std::sqrt(s.base.x), std::sqrt(s.base.y), std::sqrt(s.base.z));
    if (in.baseColor.texture)
        glass.kt.texture = std::make_shared<PowerTexture>(in.baseColor.texture, .5f);
    glass.uRoughness = glass.vRoughness = sqr(s.roughness);
    if (const TexturePtr rough = texture(s.packedSlot, TextureUse::Data, context, Rgb(s.roughness), 1))
        glass.uRoughness.texture = glass.vRoughness.texture = std::make_shared<PowerTexture>(rough, 2.f);
    std::shared_ptr<const Material> inside = makeGlass(glass);
    if (in.normals)
        inside = withNormals(inside, in.normals);
    FloatInput amount(s.transmission * (1 - (s.packedSlot ? 0 : s.metallic)));
    amount.texture = texture(s.transmissionSlot, TextureUse::Data, context, Rgb(amount.constant));
    const bool isGlassAlone = amount.constant >= 1 && !amount.texture && s.clearcoat == 0;
    if (isGlassAlone)
        return inside;
    in.transmission = 0;
    return makeMix(makeMetallicRoughness(in), inside, amount, uint32_t(m_materials.size()));
}

void MaterialBuilder::addEmission(const Source& s, const TextureContext& context,
                                  ImportedMaterial& material) {
    material.emission = s.emissive;
    if (!isBlack(s.emissive))
        material.emissionTexture = texture(s.emissiveSlot, TextureUse::Color, context);
}

MaterialBinding MaterialBuilder::make(const Source& s, const Primitive& primitive) {
    TextureContext context{primitive, s.jsonPath, s.mainUvSet(), nullptr, nullptr};
    if (!primitive.colors.empty())
        context.colors =
            std::make_shared<VertexValues<Rgb>>(VertexValues<Rgb>{primitive.mesh.indices, primitive.colors});
    if (!primitive.opacities.empty()) {
        auto opacities = std::make_shared<VertexValues<Rgb>>();
        opacities->indices = primitive.mesh.indices;
        for (const float opacity : primitive.opacities)
            opacities->values.emplace_back(opacity);
        context.opacities = std::move(opacities);
    }
    MetallicRoughnessInputs in;
    ImportedMaterial out;
    out.name = s.name;
    out.doubleSided = s.doubleSided;
    if (s.unlit) { // emits its color in all directions and reflects nothing
        const RgbInput base = baseColor(s, context);
        out.emission = base.texture ? Rgb(1) : s.base;
        out.emissionTexture = base.texture;
        out.doubleSided = true;
        in.baseColor = Rgb(0);
        in.metallic = 0;
        in.specular = 0;
    } else {
        in = inputs(s, context);
        addEmission(s, context, out);
    }
    if (s.transmission > 0 && s.thickness > 0 && !s.unlit) {
        out.material = solid(s, context, in);
        for (int c = 0; c < 3; ++c)
            out.absorption[c] =
                s.attenuationDistance > 0 && s.attenuationDistance < kInfinity
                    ? -std::log(std::clamp(s.attenuationColor[c], 1e-6f, 1.f)) / s.attenuationDistance
                    : 0;
    } else {
        out.material = makeMetallicRoughness(in);
    }
    const MaterialBinding binding{int(m_materials.size()), alpha(s, context), s.mainUvSet(),
                                  !s.slots().empty(), s.doubleSided};
    m_materials.push_back(std::move(out));
    return binding;
}

MaterialBinding MaterialBuilder::bind(const Primitive& primitive) {
    const auto found = m_shared.find(primitive.material);
    if (found != m_shared.end() && primitive.colors.empty())
        return found->second;
    const Source source = read(primitive.material);
    const MaterialBinding binding = make(source, primitive);
    if (primitive.colors.empty() && !source.usesSeveralUvSets())
        m_shared[primitive.material] = binding;
    return binding;
}

} // namespace strobe::gltf
