#include "gltf/texture.h"

#include "gltf/file/accessor.h"
#include "gltf/file/data_check.h"

#include <fstream>

namespace strobe::gltf {
namespace {

Wrap wrapOf(const Document& document, int wrap, const std::string& jsonPath) {
    switch (wrap) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
        return Wrap::Repeat;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
        return Wrap::Clamp;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
        return Wrap::Mirror;
    default:
        document.fail(jsonPath, "unknown wrap mode " + std::to_string(wrap));
    }
}

V2f pairFrom(const Document& document, const tinygltf::Value& value, const char* member, const V2f& fallback,
             const std::string& jsonPath) {
    if (!value.Has(member))
        return fallback;
    const tinygltf::Value& list = value.Get(member);
    if (list.ArrayLen() != 2 || !list.Get(0).IsNumber() || !list.Get(1).IsNumber())
        document.fail(jsonPath + "." + member, "must be two numbers");
    return {float(list.Get(0).GetNumberAsDouble()), float(list.Get(1).GetNumberAsDouble())};
}

void readTransform(const Document& document, const tinygltf::Value& value, const std::string& jsonPath,
                   TextureSlot& slot) {
    slot.offset = pairFrom(document, value, "offset", V2f(0), jsonPath);
    slot.scale = pairFrom(document, value, "scale", V2f(1), jsonPath);
    if (value.Has("rotation") && value.Get("rotation").IsNumber())
        slot.rotation = float(value.Get("rotation").GetNumberAsDouble());
    if (value.Has("texCoord") && value.Get("texCoord").IsInt())
        slot.texCoord = value.Get("texCoord").GetNumberAsInt();
}

constexpr const char* kTransform = "KHR_texture_transform";

TextureSlot slotFrom(const Document& document, int index, int texCoord,
                     const tinygltf::ExtensionMap& extensions, const std::string& jsonPath) {
    TextureSlot slot;
    slot.index = index;
    slot.texCoord = texCoord;
    if (const auto it = extensions.find(kTransform); index >= 0 && it != extensions.end())
        readTransform(document, it->second, jsonPath + ".extensions." + kTransform, slot);
    return slot;
}

} // namespace

template <class Info>
TextureSlot slotFrom(const Document& document, const Info& info, const std::string& jsonPath) {
    return slotFrom(document, info.index, info.texCoord, info.extensions, jsonPath);
}
template TextureSlot slotFrom(const Document&, const tinygltf::TextureInfo&, const std::string&);
template TextureSlot slotFrom(const Document&, const tinygltf::NormalTextureInfo&, const std::string&);

TextureSlot slotFrom(const Document& document, const tinygltf::Value& value, const char* member,
                     const std::string& jsonPath) {
    TextureSlot slot;
    if (!value.Has(member))
        return slot;
    const tinygltf::Value& info = value.Get(member);
    const std::string infoPath = jsonPath + "." + member;
    if (!info.IsObject() || !info.Has("index") || !info.Get("index").IsInt())
        document.fail(infoPath, "has no index");
    slot.index = info.Get("index").GetNumberAsInt();
    if (info.Has("texCoord") && info.Get("texCoord").IsInt())
        slot.texCoord = info.Get("texCoord").GetNumberAsInt();
    if (info.Has("extensions") && info.Get("extensions").IsObject() && info.Get("extensions").Has(kTransform))
        readTransform(document, info.Get("extensions").Get(kTransform),
                      infoPath + ".extensions." + kTransform, slot);
    return slot;
}

void UvReplacement::apply(TextureQuery& q) const {
    const uint32_t* corner = &indices[3 * size_t(q.prim)];
    const V2f a = uvs[corner[1]] - uvs[corner[0]];
    const V2f b = uvs[corner[2]] - uvs[corner[0]];
    q.uv = uvs[corner[0]] + a * q.barycentrics.x + b * q.barycentrics.y;
    // The footprint is converted from the mesh's coordinates to barycentrics, and from these to the
    // replacement's.
    const V2f c = meshUvs[corner[1]] - meshUvs[corner[0]];
    const V2f d = meshUvs[corner[2]] - meshUvs[corner[0]];
    const float det = c.x * d.y - c.y * d.x;
    const auto converted = [&](const V2f& w) {
        return det != 0 ? a * ((w.x * d.y - w.y * d.x) / det) + b * ((c.x * w.y - c.y * w.x) / det) : V2f(0);
    };
    q.duvdx = converted(q.duvdx);
    q.duvdy = converted(q.duvdy);
}

TextureQuery ImageTexture::toImageSpace(TextureQuery q) const {
    if (uvs)
        uvs->apply(q);
    const auto scaledAndRotated = [&](float u, float v) { // glTF: v = 0 at the top
        const V2f w(u * scale.x, v * scale.y);
        return V2f(rotation.x * w.x + rotation.y * w.y, rotation.x * w.y - rotation.y * w.x);
    };
    q.uv = scaledAndRotated(q.uv.x, 1 - q.uv.y) + offset;
    q.duvdx = scaledAndRotated(q.duvdx.x, -q.duvdx.y);
    q.duvdy = scaledAndRotated(q.duvdy.x, -q.duvdy.y);
    return q;
}

Rgb ImageTexture::rgb(const TextureQuery& query) const {
    const Rgb c = colorAt(query);
    if (!file)
        return c;
    const TextureQuery q = toImageSpace(query);
    return c * cache->lookup(*file, q.uv, q.duvdx, q.duvdy, options);
}

void ImageTexture::rgbSoA(const TextureQuerySoA& queries, int begin, int end, RgbSoA& out) const {
    if (!file)
        return Texture::rgbSoA(queries, begin, end, out);
    TexturePointSoA points{};
    for (int i = begin; i < end; ++i) {
        const TextureQuery q = toImageSpace(queries.at(i));
        points.uv.set(i, q.uv);
        points.duvdx.set(i, q.duvdx);
        points.duvdy.set(i, q.duvdy);
    }
    cache->lookupSoA(*file, points, begin, end, options, out);
    for (int i = begin; i < end; ++i)
        out.set(i, colorAt(queries.at(i)) * out.at(i));
}

std::shared_ptr<const EncodedImage> Images::encoded(size_t index) {
    constexpr int kMagicBytes = 5;
    auto& cached = m_encoded[index];
    if (cached)
        return cached;
    const tinygltf::Image& image = m_document.model().images[index];
    const std::string jsonPath = item("images", index);
    auto encoded = std::make_shared<EncodedImage>();
    encoded->name = m_document.path().string() + ": " + jsonPath;
    if (image.bufferView >= 0) {
        const auto bytes = viewBytes(m_document, image.bufferView, jsonPath + ".bufferView");
        encoded->bytes.assign(bytes.begin(), bytes.end());
    } else if (!image.image.empty()) {
        encoded->bytes = image.image;
    } else {
        const std::filesystem::path path = m_document.resolve(image.uri);
        std::ifstream file(path, std::ios::binary);
        std::error_code error;
        if (!file || !std::filesystem::is_regular_file(path, error)) {
            const std::string message = cannotRead(path), uriPath = jsonPath + ".uri";
            m_document.tolerate(m_diagnostics, uriPath + message, uriPath, message);
            return nullptr;
        }
        encoded->file = path;
        encoded->bytes.resize(kMagicBytes);
        file.read(reinterpret_cast<char*>(encoded->bytes.data()), kMagicBytes);
    }
    static constexpr unsigned char kPng[] = {0x89, 'P', 'N', 'G'};
    static constexpr unsigned char kJpeg[] = {0xff, 0xd8, 0xff};
    const auto startsWith = [&](std::span<const unsigned char> magic) {
        return encoded->bytes.size() > magic.size() &&
               std::equal(magic.begin(), magic.end(), encoded->bytes.begin());
    };
    if (!startsWith(kPng) && !startsWith(kJpeg))
        m_document.fail(jsonPath, "is neither a PNG nor a JPEG image");
    cached = encoded;
    return cached;
}

TextureOptions Images::samplerOptions(int index, const std::string& jsonPath) const {
    TextureOptions options;
    if (index < 0)
        return options;
    const tinygltf::Sampler& sampler =
        m_document.at(m_document.model().samplers, index, "sampler", jsonPath + ".sampler");
    const std::string samplerPath = item("samplers", size_t(index));
    options.u = wrapOf(m_document, sampler.wrapS, samplerPath + ".wrapS");
    options.v = wrapOf(m_document, sampler.wrapT, samplerPath + ".wrapT");
    options.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    return options;
}

std::shared_ptr<ImageTexture> Images::open(const TextureSlot& slot, TextureUse use,
                                           const std::string& jsonPath) {
    if (!slot)
        return nullptr;
    const tinygltf::Model& model = m_document.model();
    const tinygltf::Texture& texture = m_document.at(model.textures, slot.index, "texture", jsonPath);
    const std::string texturePath = item("textures", size_t(slot.index));
    if (texture.source < 0) {
        m_document.warnOnce(m_diagnostics, texturePath, texturePath,
                            texture.extensions.count("KHR_texture_basisu")
                                ? "has a KTX2 image only, which is not supported; the texture is ignored"
                                : "has no PNG or JPEG image; the texture is ignored");
        return nullptr;
    }
    m_document.at(model.images, texture.source, "image", texturePath + ".source");
    const std::shared_ptr<const EncodedImage> image = encoded(size_t(texture.source));
    if (!image)
        return nullptr;
    auto out = std::make_shared<ImageTexture>();
    out->options = samplerOptions(texture.sampler, texturePath);
    out->offset = slot.offset;
    out->scale = slot.scale;
    out->rotation = V2f(std::cos(slot.rotation), std::sin(slot.rotation));
    const ColorEncoding encoding{use == TextureUse::Color ? ColorEncoding::Srgb : ColorEncoding::Linear};
    out->file = m_cache.open(image, m_document.where(), encoding,
                             use == TextureUse::Alpha ? TextureChannels::Alpha : TextureChannels::Color);
    out->cache = m_cache.shared_from_this();
    return out->file ? out : nullptr;
}

} // namespace strobe::gltf
