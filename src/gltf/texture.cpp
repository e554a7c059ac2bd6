#include "gltf/texture.h"

#include "gltf/accessor.h"

#include <fstream>

namespace strobe::gltf {
namespace {

Wrap wrapOf(const Document& document, int wrap, const std::string& place) {
    switch (wrap) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
        return Wrap::Repeat;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
        return Wrap::Clamp;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
        return Wrap::Mirror;
    default:
        document.fail(place, "unknown wrap mode " + std::to_string(wrap));
    }
}

V2f pairFrom(const Document& document, const tinygltf::Value& value, const char* member, const V2f& fallback,
             const std::string& place) {
    if (!value.Has(member))
        return fallback;
    const tinygltf::Value& list = value.Get(member);
    if (list.ArrayLen() != 2 || !list.Get(0).IsNumber() || !list.Get(1).IsNumber())
        document.fail(place + "." + member, "must be two numbers");
    return {float(list.Get(0).GetNumberAsDouble()), float(list.Get(1).GetNumberAsDouble())};
}

void readTransform(const Document& document, const tinygltf::Value& value, const std::string& place,
                   TextureSlot& slot) {
    slot.offset = pairFrom(document, value, "offset", V2f(0), place);
    slot.scale = pairFrom(document, value, "scale", V2f(1), place);
    if (value.Has("rotation") && value.Get("rotation").IsNumber())
        slot.rotation = float(value.Get("rotation").GetNumberAsDouble());
    if (value.Has("texCoord") && value.Get("texCoord").IsInt())
        slot.texCoord = value.Get("texCoord").GetNumberAsInt();
}

constexpr const char* kTransform = "KHR_texture_transform";

TextureSlot slotFrom(const Document& document, int index, int texCoord,
                     const tinygltf::ExtensionMap& extensions, const std::string& place) {
    TextureSlot slot;
    slot.index = index, slot.texCoord = texCoord;
    if (const auto it = extensions.find(kTransform); index >= 0 && it != extensions.end())
        readTransform(document, it->second, place + ".extensions." + kTransform, slot);
    return slot;
}

} // namespace

template <class Info>
TextureSlot slotFrom(const Document& document, const Info& info, const std::string& place) {
    return slotFrom(document, info.index, info.texCoord, info.extensions, place);
}
template TextureSlot slotFrom(const Document&, const tinygltf::TextureInfo&, const std::string&);
template TextureSlot slotFrom(const Document&, const tinygltf::NormalTextureInfo&, const std::string&);

TextureSlot slotFrom(const Document& document, const tinygltf::Value& value, const char* member,
                     const std::string& place) {
    TextureSlot slot;
    if (!value.Has(member))
        return slot;
    const tinygltf::Value& info = value.Get(member);
    const std::string there = place + "." + member;
    if (!info.IsObject() || !info.Has("index") || !info.Get("index").IsInt())
        document.fail(there, "has no index");
    slot.index = info.Get("index").GetNumberAsInt();
    if (info.Has("texCoord") && info.Get("texCoord").IsInt())
        slot.texCoord = info.Get("texCoord").GetNumberAsInt();
    if (info.Has("extensions") && info.Get("extensions").IsObject() && info.Get("extensions").Has(kTransform))
        readTransform(document, info.Get("extensions").Get(kTransform), there + ".extensions." + kTransform,
                      slot);
    return slot;
}

void OtherUvs::apply(TextureQuery& q) const {
    const uint32_t* corner = &indices[3 * size_t(q.prim)];
    const V2f a = other[corner[1]] - other[corner[0]], b = other[corner[2]] - other[corner[0]];
    q.uv = other[corner[0]] + a * q.barycentrics.x + b * q.barycentrics.y;
    // From the mesh's coordinates to barycentric ones, to the others.
    const V2f c = mesh[corner[1]] - mesh[corner[0]], d = mesh[corner[2]] - mesh[corner[0]];
    const float det = c.x * d.y - c.y * d.x;
    const auto turned = [&](const V2f& w) {
        return det != 0 ? a * ((w.x * d.y - w.y * d.x) / det) + b * ((c.x * w.y - c.y * w.x) / det) : V2f(0);
    };
    q.duvdx = turned(q.duvdx), q.duvdy = turned(q.duvdy);
}

TextureQuery PlacedImage::inImage(TextureQuery q) const {
    if (uvs)
        uvs->apply(q);
    const auto turned = [&](float u, float v) { // v from the top
        const V2f w(u * scale.x, v * scale.y);
        return V2f(turn.x * w.x + turn.y * w.y, turn.x * w.y - turn.y * w.x);
    };
    q.uv = turned(q.uv.x, 1 - q.uv.y) + offset;
    q.duvdx = turned(q.duvdx.x, -q.duvdx.y), q.duvdy = turned(q.duvdy.x, -q.duvdy.y);
    return q;
}

Rgb PlacedImage::rgb(const TextureQuery& query) const {
    const Rgb c = colorAt(query);
    if (!file)
        return c;
    const TextureQuery q = inImage(query);
    return c * cache->lookup(*file, q.uv, q.duvdx, q.duvdy, how);
}

void PlacedImage::rgbSoA(const TextureQuerySoA& queries, int begin, int end, RgbSoA& out) const {
    if (!file)
        return Texture::rgbSoA(queries, begin, end, out);
    TexturePointSoA points{};
    for (int i = begin; i < end; ++i) {
        const TextureQuery q = inImage(queries.at(i));
        points.uv.set(i, q.uv), points.duvdx.set(i, q.duvdx), points.duvdy.set(i, q.duvdy);
    }
    cache->lookupSoA(*file, points, begin, end, how, out);
    for (int i = begin; i < end; ++i)
        out.set(i, colorAt(queries.at(i)) * out.at(i));
}

std::shared_ptr<const EncodedImage> Images::encoded(size_t index) {
    auto& kept = m_encoded[index];
    if (kept)
        return kept;
    const tinygltf::Image& image = m_document.model().images[index];
    const std::string place = item("images", index);
    auto made = std::make_shared<EncodedImage>();
    made->name = m_document.path().string() + ": " + place;
    if (image.bufferView >= 0) {
        const auto bytes = viewBytes(m_document, image.bufferView, place + ".bufferView");
        made->bytes.assign(bytes.begin(), bytes.end());
    } else if (!image.image.empty()) {
        made->bytes = image.image;
    } else {
        const std::filesystem::path path = m_document.resolve(image.uri);
        std::ifstream file(path, std::ios::binary);
        std::error_code error;
        if (!file || !std::filesystem::is_regular_file(path, error))
            m_document.fail(place + ".uri", "\"" + path.string() + "\" cannot be read");
        made->bytes.assign(std::istreambuf_iterator<char>(file), {});
    }
    static constexpr unsigned char kPng[] = {0x89, 'P', 'N', 'G'}, kJpeg[] = {0xff, 0xd8, 0xff};
    const auto startsWith = [&](std::span<const unsigned char> magic) {
        return made->bytes.size() > magic.size() &&
               std::equal(magic.begin(), magic.end(), made->bytes.begin());
    };
    if (!startsWith(kPng) && !startsWith(kJpeg))
        m_document.fail(place, "is neither a PNG nor a JPEG image");
    return kept = made;
}

TextureOptions Images::lookupOf(int index, const std::string& place) const {
    TextureOptions how;
    if (index < 0)
        return how;
    const tinygltf::Sampler& sampler =
        m_document.at(m_document.model().samplers, index, "sampler", place + ".sampler");
    const std::string there = item("samplers", size_t(index));
    how.u = wrapOf(m_document, sampler.wrapS, there + ".wrapS");
    how.v = wrapOf(m_document, sampler.wrapT, there + ".wrapT");
    how.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    return how;
}

std::shared_ptr<PlacedImage> Images::open(const TextureSlot& slot, TextureUse use, const std::string& place) {
    if (!slot)
        return nullptr;
    const tinygltf::Model& model = m_document.model();
    const tinygltf::Texture& texture = m_document.at(model.textures, slot.index, "texture", place);
    const std::string there = item("textures", size_t(slot.index));
    if (texture.source < 0) {
        m_document.warnOnce(m_messages, there, there,
                            "has no PNG or JPEG image; what it would color stays without texture");
        return nullptr;
    }
    m_document.at(model.images, texture.source, "image", there + ".source");
    auto out = std::make_shared<PlacedImage>();
    out->how = lookupOf(texture.sampler, there);
    out->offset = slot.offset, out->scale = slot.scale;
    out->turn = V2f(std::cos(slot.rotation), std::sin(slot.rotation));
    const ColorEncoding transfer{use == TextureUse::Color ? ColorEncoding::Srgb : ColorEncoding::Linear};
    out->file = m_cache.open(encoded(size_t(texture.source)), m_document.where(), transfer,
                             use == TextureUse::Alpha ? TextureChannels::Alpha : TextureChannels::Color);
    out->cache = m_cache.shared_from_this();
    return out->file ? out : nullptr;
}

} // namespace strobe::gltf
