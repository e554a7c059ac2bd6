// Materials of a glTF file, created for the primitives that use them.
#pragma once

#include "core/util/diagnostics.h"
#include "gltf/import.h"
#include "gltf/mesh.h"
#include "gltf/texture.h"
#include "materials/metallic_roughness.h"

#include <map>

namespace strobe::gltf {

/// The material of a primitive, and the properties of the primitive's mesh that depend on it.
struct MaterialBinding {
    int material = 0;     ///< index into MaterialBuilder::take()
    FloatInput alpha{1};  ///< of the mesh
    int uvSet = 0;        ///< index of the TEXCOORD that becomes the mesh's uvs
    bool usesUvs = false; ///< the material has textures
    bool doubleSided = false;
};

/// Creates each material once; primitives with vertex colors, or whose material uses several sets of texture
/// coordinates, get a material of their own.
class MaterialBuilder {
  public:
    MaterialBuilder(const Document& document, TextureCache& cache, Diagnostics& diagnostics)
        : m_document(document), m_images(document, cache, diagnostics), m_diagnostics(diagnostics) {}
    MaterialBinding bind(const Primitive& primitive);
    /// Moves out the materials of all bindings.
    std::vector<ImportedMaterial> take() { return std::move(m_materials); }

  private:
    /// The factors and texture references of a material and its extensions.
    struct Source;
    /// The data of a primitive that its textures need.
    struct TextureContext;

    Source read(int material) const;
    void readExtensions(const tinygltf::Material& material, Source& source) const;
    void readFinish(const tinygltf::Material& material, Source& source) const;
    MaterialBinding make(const Source& source, const Primitive& primitive);
    MetallicRoughnessInputs inputs(const Source& source, const TextureContext& context);
    void addFinish(const Source& source, const TextureContext& context, MetallicRoughnessInputs& inputs);
    std::shared_ptr<const Material> solid(const Source& source, const TextureContext& context,
                                          MetallicRoughnessInputs inputs);
    void addEmission(const Source& source, const TextureContext& context, ImportedMaterial& material);
    /// Returns the texture of a slot; null: none.
    std::shared_ptr<ImageTexture> texture(const TextureSlot& slot, TextureUse use,
                                          const TextureContext& context, const Rgb& factor = Rgb(1),
                                          int channel = 0);
    RgbInput baseColor(const Source& source, const TextureContext& context);
    FloatInput alpha(const Source& source, const TextureContext& context);
    std::string nameOf(int material) const;

    const Document& m_document;
    Images m_images;
    Diagnostics& m_diagnostics;
    std::map<int, MaterialBinding> m_shared; ///< by material, -1: the default material
    std::vector<ImportedMaterial> m_materials;
};

} // namespace strobe::gltf
