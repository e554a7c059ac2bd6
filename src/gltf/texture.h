// Textures: the images of a glTF file, and their mapping onto primitives.
#pragma once

#include "core/image/texture_cache.h"
#include "core/interfaces/texture.h"
#include "core/util/diagnostics.h"
#include "gltf/file/document.h"
#include "gltf/mesh.h"

#include <map>

namespace strobe::gltf {

/// A texture reference of a material.
struct TextureSlot {
    int index = -1;   ///< into the file's textures; -1: none
    int texCoord = 0; ///< set of texture coordinates
    // KHR_texture_transform, from the file's coordinates (v = 0 at the top) to the image's:
    V2f offset{0}, scale{1};
    float rotation = 0; ///< radians, counter-clockwise

    explicit operator bool() const { return index >= 0; }
};
/// Returns the slot of a texture info with its extensions. `Info`: tinygltf::TextureInfo or
/// NormalTextureInfo.
template <class Info>
TextureSlot slotFrom(const Document& document, const Info& info, const std::string& jsonPath);
/// Returns the slot of the texture info `member` of an extension `value`; an empty slot if it has no such
/// member.
TextureSlot slotFrom(const Document& document, const tinygltf::Value& value, const char* member,
                     const std::string& jsonPath);

/// Values at the vertices of a mesh.
template <class T>
struct VertexValues {
    std::vector<uint32_t> indices; ///< three per triangle
    std::vector<T> values;

    T at(const TextureQuery& q) const {
        const uint32_t* corner = &indices[3 * size_t(q.prim)];
        const float u = q.barycentrics.x, v = q.barycentrics.y;
        return values[corner[0]] * (1 - u - v) + values[corner[1]] * u + values[corner[2]] * v;
    }
};

/// A set of texture coordinates that replaces the mesh's.
struct UvReplacement {
    std::vector<uint32_t> indices; ///< three per triangle
    std::vector<V2f> meshUvs, uvs; ///< by vertex: the mesh's coordinates and their replacements
    /// Replaces the texture coordinates and the footprint of a query.
    void apply(TextureQuery& q) const;
};

/// The product of an image (optional), a factor, and vertex colors (optional). Its value is one channel of
/// it.
class ImageTexture : public Texture {
  public:
    std::shared_ptr<const TextureCache> cache; ///< null: no image
    std::shared_ptr<const TextureCache::File> file;
    TextureOptions options;
    V2f offset{0}, scale{1}, rotation{1, 0};  ///< of TextureSlot; the rotation as cosine and sine
    std::shared_ptr<const UvReplacement> uvs; ///< null: the mesh's
    Rgb factor{1};
    std::shared_ptr<const VertexValues<Rgb>> colors; ///< null: none
    int channel = 0;

    Rgb rgb(const TextureQuery& q) const override;
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const override;
    float value(const TextureQuery& q) const override { return rgb(q)[channel]; }
    bool needsFootprint() const override { return file != nullptr && !options.nearest; }

  private:
    Rgb colorAt(const TextureQuery& q) const { return colors ? factor * colors->at(q) : factor; }
    /// Returns the query with the coordinates and the footprint in the image.
    TextureQuery toImageSpace(TextureQuery q) const;
};

/// offset + scale t^exponent of another texture t, for values that glTF defines differently.
class PowerTexture : public Texture {
  public:
    PowerTexture(std::shared_ptr<const Texture> t, float exponent, float scale = 1, float offset = 0)
        : m_texture(std::move(t)), m_exponent(exponent), m_scale(scale), m_offset(offset) {}
    Rgb rgb(const TextureQuery& q) const override {
        const Rgb c = m_texture->rgb(q);
        return {changed(c.x), changed(c.y), changed(c.z)};
    }
    float value(const TextureQuery& q) const override { return changed(m_texture->value(q)); }
    bool needsFootprint() const override { return m_texture->needsFootprint(); }

  private:
    float changed(float x) const { return m_offset + m_scale * std::pow(std::max(x, 0.f), m_exponent); }
    std::shared_ptr<const Texture> m_texture;
    float m_exponent, m_scale, m_offset;
};

/// The interpretation of a texture's stored numbers.
enum class TextureUse { Color, Data, Alpha };

/// Opens the images of a document.
class Images {
  public:
    Images(const Document& document, TextureCache& cache, Diagnostics& diagnostics)
        : m_document(document), m_cache(cache), m_diagnostics(diagnostics) {}
    /// Returns the texture of a slot; null if the slot is empty, the texture has no supported image, or the
    /// image has no alpha channel and `use` is Alpha. `jsonPath`: that of the material.
    std::shared_ptr<ImageTexture> open(const TextureSlot& slot, TextureUse use, const std::string& jsonPath);

  private:
    /// Returns null, with a warning, if the file of the image is missing.
    std::shared_ptr<const EncodedImage> encoded(size_t image);
    TextureOptions samplerOptions(int sampler, const std::string& jsonPath) const;

    const Document& m_document;
    TextureCache& m_cache;
    Diagnostics& m_diagnostics;
    std::map<size_t, std::shared_ptr<const EncodedImage>> m_encoded;
};

} // namespace strobe::gltf
