// Textures: images wherever they lie, and how they are placed on primitives.
#pragma once

#include "core/image/texture_cache.h"
#include "core/interfaces/texture.h"
#include "gltf/document.h"
#include "gltf/mesh.h"

#include <map>

namespace strobe::gltf {

/// What a material says about one of its textures.
struct TextureSlot {
    int index = -1; ///< into the file's textures; -1: none
    int texCoord = 0;
    // KHR_texture_transform, from the file's coordinates (v = 0 at the top) to the image's:
    V2f offset{0}, scale{1};
    float rotation = 0; ///< radians, counter-clockwise as seen

    explicit operator bool() const { return index >= 0; }
};
/// Reads a slot with its extensions; `info` is a tinygltf::TextureInfo or one of its kin.
template <class Info>
TextureSlot slotFrom(const Document& document, const Info& info, const std::string& place);
/// The same from a texture info inside an extension; nothing when `value` has no such member.
TextureSlot slotFrom(const Document& document, const tinygltf::Value& value, const char* member,
                     const std::string& place);

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

/// Texture coordinates beside those of the mesh.
struct OtherUvs {
    std::vector<uint32_t> indices;
    std::vector<V2f> mesh, other;
    /// Replaces the query's texture coordinates, footprint included.
    void apply(TextureQuery& q) const;
};

/// An image (or none), placed, times a factor, times a color at the vertices (or none). As a number it is
/// one channel of that.
class PlacedImage : public Texture {
  public:
    std::shared_ptr<const TextureCache> cache; ///< null: no image
    std::shared_ptr<const TextureCache::File> file;
    TextureOptions how;
    V2f offset{0}, scale{1}, turn{1, 0}; ///< of TextureSlot; the turn as cosine and sine
    std::shared_ptr<const OtherUvs> uvs; ///< null: the mesh's
    Rgb factor{1};
    std::shared_ptr<const VertexValues<Rgb>> colors; ///< null: none
    int channel = 0;

    Rgb rgb(const TextureQuery& q) const override;
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const override;
    float value(const TextureQuery& q) const override { return rgb(q)[channel]; }
    bool needsFootprint() const override { return file != nullptr && !how.nearest; }

  private:
    Rgb colorAt(const TextureQuery& q) const { return colors ? factor * colors->at(q) : factor; }
    /// The place in the image; the query's coordinates and footprint become the image's.
    TextureQuery inImage(TextureQuery q) const;
};

/// How a texture's stored numbers are meant.
enum class TextureUse { Color, Data, Alpha };

/// Opens the images of a document.
class Images {
  public:
    Images(const Document& document, TextureCache& cache, Diagnostics& messages)
        : m_document(document), m_cache(cache), m_messages(messages) {}
    /// The texture of a slot; null where the slot has none, or its image no alpha that is asked for.
    std::shared_ptr<PlacedImage> open(const TextureSlot& slot, TextureUse use, const std::string& place);

  private:
    std::shared_ptr<const EncodedImage> encoded(size_t image);
    TextureOptions lookupOf(int sampler, const std::string& place) const;

    const Document& m_document;
    TextureCache& m_cache;
    Diagnostics& m_messages;
    std::map<size_t, std::shared_ptr<const EncodedImage>> m_encoded;
};

} // namespace strobe::gltf
