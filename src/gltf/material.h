// Materials of a glTF file, as they are asked for by primitives.
#pragma once

#include "gltf/import.h"
#include "gltf/mesh.h"
#include "gltf/texture.h"
#include "materials/metallic_roughness.h"

#include <map>

namespace strobe::gltf {

/// How a primitive looks.
struct Look {
    int material = 0;    ///< index into MaterialBuilder::take()
    FloatInput alpha{1}; ///< of its mesh
    int uvSet = 0;       ///< which TEXCOORD its mesh's uvs are to be
    bool usesUvs = false;
};

/// Makes materials, each once; primitives with vertex colors, or with a second set of texture coordinates
/// that is used beside the first, have one of their own.
class MaterialBuilder {
  public:
    MaterialBuilder(const Document& document, TextureCache& cache, Diagnostics& messages)
        : m_document(document), m_images(document, cache, messages), m_messages(messages) {}
    Look look(const Primitive& primitive);
    std::vector<ImportedMaterial> take() { return std::move(m_materials); }

  private:
    /// A material's textures, and the numbers of its extensions.
    struct Source;
    /// Of one primitive: what its textures are placed by.
    struct Placement;

    Source read(int material) const;
    Look make(const Source& source, const Primitive& primitive);
    std::shared_ptr<PlacedImage> texture(const TextureSlot& slot, TextureUse use, const Placement& placement,
                                         const Rgb& factor = Rgb(1), int channel = 0);
    RgbInput baseColor(const Source& source, const Placement& placement);
    FloatInput alpha(const Source& source, const Placement& placement);
    std::string nameOf(int material) const;

    const Document& m_document;
    Images m_images;
    Diagnostics& m_messages;
    std::map<int, Look> m_shared; ///< by material, -1 the default one
    std::vector<ImportedMaterial> m_materials;
};

} // namespace strobe::gltf
