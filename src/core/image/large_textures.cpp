#include "core/image/large_textures.h"

#include "core/util/resource_policy.h"

#include <chrono>

namespace strobe {
namespace {

uint64_t bytesOf(const MipLayout& layout, int channels, const TexelCodec& codec) {
    return uint64_t(layout.texels) * uint64_t(channels) * codec.bytes();
}

} // namespace

LargeTexture::LargeTexture(ImageSource source, std::string displayName, const Location& where,
                           const ImageReader& header)
    : m_source(std::move(source)), m_displayName(std::move(displayName)), m_where(where),
      m_layout(MipLayout::halving(header.width, header.height)), m_stored(header.stored) {
    m_source.firstChannel(header, m_channels);
    if (m_source.encoding.kind == ColorEncoding::Space && m_source.channels == TextureChannels::Color)
        m_channels = 3; // gray in the color space may have a tint in the working space
}

bool LargeTextures::accepts(const ImageReader& header, const ColorEncoding& encoding) {
    const int64_t texels = int64_t(header.width) * header.height;
    // Files of tiles are read tile by tile as they are, unless their values must be decoded.
    const bool isReadByTile = header.isTiled && !encoding.hasEffect(header.isFloat);
    return header.isUncropped && !isReadByTile && header.depth == 1 && texels > 0 &&
           texels <= kMaxImagePixels;
}

std::shared_ptr<const TexelCodec> LargeTextures::codecOf(StoredType stored, const ColorEncoding& encoding) {
    const TexelCodec codec = TexelCodec::of(stored, encoding);
    const std::string key =
        std::to_string(codec.kind()) +
        (codec.kind() == TexelCodec::Byte ? ImageSource{{}, {}, {}, encoding}.key("") : "");
    std::shared_ptr<const TexelCodec>& shared = m_codecs[key];
    if (!shared)
        shared = std::make_shared<const TexelCodec>(codec);
    return shared;
}

std::shared_ptr<LargeTexture> LargeTextures::add(const ImageSource& source, const std::string& name,
                                                 const Location& where, const ImageReader& header) {
    const std::lock_guard lock(m_mutex);
    std::shared_ptr<LargeTexture>& texture = m_byKey[source.key(name)];
    if (texture)
        return texture;
    auto added = std::make_shared<LargeTexture>(source, name, where, header);
    const bool isAlpha = source.channels == TextureChannels::Alpha;
    added->m_codec = codecOf(header.stored, isAlpha ? ColorEncoding{} : source.encoding);
    const uint64_t values = uint64_t(header.width) * uint64_t(header.height) * uint64_t(added->m_channels);
    const uint64_t bytes = bytesOf(added->m_layout, added->m_channels, *added->m_codec);
    // While it is read: the finest level as stored, and the next one as floats.
    const uint64_t reading =
        values * (added->m_codec->keeps(header.stored) ? added->m_codec->bytes() : 4) + values;
    resourcePolicyOf(where).requireMemory(reading + std::min(bytes, m_limit), "the image " + name,
                                          "reduce its resolution, or convert it with maketx", where);
    texture = added;
    m_bytes += bytes;
    ++m_counts.images;
    m_textures.push_back(texture);
    return texture;
}

const MipMap& LargeTextures::waitFor(LargeTexture& texture) {
    std::unique_lock lock(m_mutex);
    while (!texture.m_isDone) {
        LargeTexture* next = texture.m_isTaken ? nullptr : &texture;
        for (; !next && m_firstUnread < m_textures.size(); ++m_firstUnread)
            if (LargeTexture& unread = *m_textures[m_firstUnread]; !unread.m_isTaken)
                next = &unread;
        if (!next) {
            m_isRead.wait(lock);
            continue;
        }
        next->m_isTaken = true;
        lock.unlock();
        std::exception_ptr error;
        const auto start = std::chrono::steady_clock::now();
        try {
            read(*next);
        } catch (...) { // rethrown by the threads that use the image
            error = std::current_exception();
        }
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        lock.lock();
        next->m_error = error;
        next->m_isDone = true;
        ++m_counts.imagesRead;
        m_counts.secondsToRead += seconds.count();
        m_isRead.notify_all();
    }
    if (texture.m_error)
        std::rethrow_exception(texture.m_error);
    return *texture.m_mipMap;
}

std::unique_ptr<TexelMemory> LargeTextures::allocate(const LargeTexture& texture, size_t bytes) {
    {
        const std::lock_guard lock(m_mutex);
        if (m_bytes <= m_limit) {
            m_counts.bytesInMemory += bytes;
            // Textures that are added later share what is left, or at least a quarter.
            m_pager.setLimit(std::max(m_limit - std::min(m_counts.bytesInMemory, m_limit), m_limit / 4));
            return std::make_unique<TexelMemory>(bytes);
        }
    }
    return std::make_unique<TexelMemory>(bytes, m_pager, "the image " + texture.m_displayName);
}

void LargeTextures::read(LargeTexture& texture) {
    std::string error;
    const auto fail = [&]() -> Error {
        return {texture.m_where, "cannot read the image " + texture.m_displayName + ": " + error};
    };
    const auto file = texture.m_source.open(error);
    if (!file)
        throw fail();
    const bool isAlpha = texture.m_source.channels == TextureChannels::Alpha;
    int stored = 0;
    const TexelSource source{*file, texture.m_source.firstChannel(*file, stored), texture.m_channels,
                             isAlpha ? ColorEncoding{} : texture.m_source.encoding};
    const MipLayout::Level& finest = texture.m_layout.levels.front();
    if (file->levelSize(0) != V2i(finest.width, finest.height) || file->stored != texture.m_stored) {
        error = "the file has changed";
        throw fail();
    }
    auto memory = allocate(texture, bytesOf(texture.m_layout, texture.m_channels, *texture.m_codec));
    bool hasInvalidValues = false;
    if (!writeMipLevels(source, texture.m_layout, *texture.m_codec, *memory, hasInvalidValues, error))
        throw fail();
    if (memory->isInFile())
        memory->dropAll();
    texture.m_hasInvalidValues.store(hasInvalidValues, std::memory_order_relaxed);
    texture.m_mipMap = std::make_unique<const MipMap>(texture.m_layout, std::move(memory), texture.m_codec,
                                                      texture.m_channels);
    texture.m_ready.store(texture.m_mipMap.get(), std::memory_order_release);
}

LargeTextureCounts LargeTextures::counts() const {
    const std::lock_guard lock(m_mutex);
    LargeTextureCounts counts = m_counts;
    counts.pages = m_pager.counts();
    return counts;
}

} // namespace strobe
