// Images that are too large to be kept as floats.
#pragma once

#include "core/image/image_source.h"
#include "core/image/mip_map.h"

#include <condition_variable>
#include <map>

namespace strobe {

/// An image whose MIP levels are read when it is first looked up.
class LargeTexture {
  public:
    LargeTexture(ImageSource source, std::string displayName, const Location& where,
                 const ImageReader& header);
    LargeTexture(const LargeTexture&) = delete;
    LargeTexture& operator=(const LargeTexture&) = delete;

    const std::string& displayName() const { return m_displayName; }
    /// Whether the image has values that are NaN or infinite. False before it is read.
    bool hasInvalidValues() const { return m_hasInvalidValues.load(std::memory_order_relaxed); }

  private:
    friend class LargeTextures;
    const ImageSource m_source;
    const std::string m_displayName; ///< in error messages
    const Location m_where;
    MipLayout m_layout;
    int m_channels = 0; ///< 1 or 3
    StoredType m_stored = StoredType::Float;
    std::shared_ptr<const TexelCodec> m_codec;

    std::atomic<const MipMap*> m_ready{nullptr}; ///< null: not read, or damaged
    std::unique_ptr<const MipMap> m_mipMap;
    std::atomic<bool> m_hasInvalidValues{false};
    // Guarded by LargeTextures::m_mutex:
    bool m_isTaken = false; ///< a thread reads the image, or has read it
    std::exception_ptr m_error;
    bool m_isDone = false;
};

/// Counts of large textures.
struct LargeTextureCounts {
    size_t images = 0, imagesRead = 0;
    uint64_t bytesInMemory = 0; ///< of textures that are kept in memory as a whole
    double secondsToRead = 0;   ///< of all threads
    PageCounts pages;
};

/// The large textures of a cache. Values are stored in the type of their file. If all large textures together
/// exceed the limit, their levels are moved to temporary files. Thread-safe.
class LargeTextures {
  public:
    /// `limit`: bytes of texels to keep in memory.
    explicit LargeTextures(uint64_t limit) : m_limit(limit), m_pager(limit) {}

    /// Whether an image is large, given its header.
    static bool accepts(const ImageReader& header, const ColorEncoding& encoding);
    /// Adds an image, or returns the one that was added with the same key. Throws Error at `where` if reading
    /// it would take more memory than is allowed.
    std::shared_ptr<LargeTexture> add(const ImageSource& source, const std::string& name,
                                      const Location& where, const ImageReader& header);
    /// Returns the MIP levels. The first call for an image reads it. A thread whose image is read by another
    /// thread reads further images until then. Throws Error at the location of `add` if the image is damaged.
    const MipMap& mipMap(LargeTexture& texture) {
        const MipMap* ready = texture.m_ready.load(std::memory_order_acquire);
        return ready ? *ready : waitFor(texture);
    }
    LargeTextureCounts counts() const;

  private:
    const MipMap& waitFor(LargeTexture& texture);
    void read(LargeTexture& texture);
    std::unique_ptr<TexelMemory> allocate(const LargeTexture& texture, size_t bytes);
    std::shared_ptr<const TexelCodec> codecOf(StoredType stored, const ColorEncoding& encoding);

    const uint64_t m_limit;
    TexelPager m_pager; ///< outlives the textures
    mutable std::mutex m_mutex;
    std::condition_variable m_isRead;
    std::vector<std::shared_ptr<LargeTexture>> m_textures;
    std::map<std::string, std::shared_ptr<LargeTexture>> m_byKey;
    std::map<std::string, std::shared_ptr<const TexelCodec>> m_codecs;
    size_t m_firstUnread = 0;
    uint64_t m_bytes = 0; ///< of all textures, whether read or not
    LargeTextureCounts m_counts;
};

} // namespace strobe
